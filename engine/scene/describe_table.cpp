#include "engine/scene/describe_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

void add_objects(const ValueSpec& value, std::vector<const ObjectSpec*>& found) {
    for (const ValueSpec& one : value.alternatives) add_objects(one, found);
    if (value.object == nullptr || std::find(found.begin(), found.end(), value.object) != found.end()) return;
    found.push_back(value.object);
    for (const FieldSpec& field : value.object->fields) add_objects(field.value, found);
}

std::string with_si_unit(std::string text, Dimension dimension) {
    const std::string unit = Units{}.name(dimension);
    return unit.empty() ? text : text + " " + unit;
}

} // namespace

std::string range_text(const Range& range, Dimension dimension) {
    const bool below = std::isfinite(range.least), above = std::isfinite(range.most);
    std::string text;
    if (below && above && range.above_least)
        text = fmt::format("more than {:.6g}, at most {:.6g}", range.least, range.most);
    else if (below && above)
        text = fmt::format("{:.6g} to {:.6g}", range.least, range.most);
    else if (below)
        text = fmt::format("{} {:.6g}", range.above_least ? "more than" : "at least", range.least);
    else if (above)
        text = fmt::format("at most {:.6g}", range.most);
    return text.empty() ? text : with_si_unit(text, dimension);
}

std::string default_text(const FieldSpec& field) {
    if (const bool* flag = std::get_if<bool>(&field.otherwise)) return *flag ? "true" : "false";
    if (const double* number = std::get_if<double>(&field.otherwise))
        return with_si_unit(fmt::format("{:.6g}", *number), field.value.dimension);
    if (const auto* word = std::get_if<std::string_view>(&field.otherwise)) return fmt::format("\"{}\"", *word);
    if (const Vec3* v = std::get_if<Vec3>(&field.otherwise)) {
        const Dimension dimension = field.value.columns.empty() ? Dimension::None : field.value.columns.front().dimension;
        return with_si_unit(fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v->x(), v->y(), v->z()), dimension);
    }
    return "";
}

std::vector<const ObjectSpec*> reachable_objects(const ObjectSpec& root) {
    std::vector<const ObjectSpec*> found;
    ValueSpec value;
    value.object = &root;
    add_objects(value, found);
    return found;
}

} // namespace trocar::engine
