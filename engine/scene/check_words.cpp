// Words of the checker: what was expected, what is out of range, which unit was probably meant.
#include "engine/scene/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

/// The unit in which the number would be usual (or at least allowed), if there is one.
std::string meant_unit(double value, Dimension dimension, const Range& range, const Units& units) {
    const double factor = units.factor(dimension);
    for (const bool usual : {true, false}) {
        const double least = usual ? std::max(range.least, range.usual_least) : range.least;
        const double most = usual ? std::min(range.most, range.usual_most) : range.most;
        for (const UnitName& unit : known_units(dimension)) {
            const double si = value * unit.factor;
            if (si < least || si > most || si == 0.0 || unit.factor == factor) continue;
            return fmt::format("; was it meant in {}? then expected {:.6g}", unit.name, si / factor);
        }
    }
    return "";
}

std::string columns_text(const std::vector<Column>& columns, const Units& units) {
    std::vector<std::string> names, dimensions;
    for (const Column& column : columns) {
        names.emplace_back(column.name);
        const std::string unit = units.name(column.dimension);
        if (!unit.empty() && (dimensions.empty() || dimensions.back() != unit)) dimensions.push_back(unit);
    }
    std::string text = fmt::format("{} numbers [{}]", columns.size(), fmt::join(names, ", "));
    if (!dimensions.empty()) text += fmt::format(" in {}", fmt::join(dimensions, ", "));
    return text;
}

std::string object_text(const ObjectSpec& object) {
    if (!object.marker.empty()) return fmt::format("an object with the key \"{}\"", object.marker);
    return fmt::format("an object with keys such as \"{}\"", object.fields.front().key);
}

} // namespace

std::string out_of_range(const JsonNode& node, Dimension dimension, const Range& range, const Units& units) {
    const double factor = units.factor(dimension);
    const std::string unit = dimension == Dimension::None ? "" : " " + units.name(dimension);
    std::string text = fmt::format("found {}{}", node.text, unit);
    if (factor != 1.0) text += fmt::format(", that is {}", with_unit(node.number * factor, dimension, Units{}));
    text += "; expected ";
    const double least = range.least / factor, most = range.most / factor;
    if (std::isinf(range.most))
        text += fmt::format("{} {:.6g}{}", range.above_least ? "more than" : "at least", least, unit);
    else if (range.above_least)
        text += fmt::format("more than {:.6g} and at most {:.6g}{}", least, most, unit);
    else
        text += fmt::format("{:.6g} to {:.6g}{}", least, most, unit);
    if (!range.what.empty()) text += fmt::format(" ({})", range.what);
    return text + meant_unit(node.number, dimension, range, units);
}

std::string expected(const ValueSpec& value, const Units& units) {
    const std::string unit = units.name(value.dimension);
    switch (value.kind) {
    case ValueKind::Number:
        return unit.empty() ? "a number" : "a number in " + unit;
    case ValueKind::Count:
        return fmt::format("an integer from {:.0f} to {:.0f}", value.range.least, value.range.most);
    case ValueKind::Flag:
        return "true or false";
    case ValueKind::Text:
        return "a string";
    case ValueKind::Path:
        return "a file name";
    case ValueKind::Choice:
        return fmt::format("{}\"{}\"", value.choices.size() > 1 ? "one of " : "", fmt::join(value.choices, "\", \""));
    case ValueKind::Vector:
        return columns_text(value.columns, units);
    case ValueKind::Rows: {
        const bool fixed = value.least_count == value.most_count;
        const std::string how_many = fixed ? std::to_string(value.least_count) : fmt::format("at least {}", value.least_count);
        return fmt::format("a list of {} rows of {}", how_many, columns_text(value.columns, units));
    }
    case ValueKind::List:
        return fmt::format("a list{} of {}", value.least_count > 0 ? fmt::format(" (at least {})", value.least_count) : "",
                           expected(value.alternatives.front(), units));
    case ValueKind::Object:
        return object_text(*value.object);
    case ValueKind::Map:
        return "an object with names as keys";
    case ValueKind::Any:
        return "a JSON value";
    case ValueKind::Alternatives: {
        std::vector<std::string> all;
        for (const ValueSpec& one : value.alternatives) all.push_back(expected(one, units));
        return fmt::format("{}", fmt::join(all, ", or "));
    }
    }
    return "";
}

std::string with_unit(double si, Dimension dimension, const Units& units) {
    const double factor = units.factor(dimension);
    if (dimension == Dimension::None) return fmt::format("{:.6g}", si);
    return fmt::format("{:.6g} {}", si / factor, units.name(dimension));
}

} // namespace trocar::engine
