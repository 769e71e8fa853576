#include "engine/scene/check_keys.hpp"

#include "engine/scene/describe_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

constexpr double kUnitLength = 1e-6; // [-] by which the length of a direction may differ from 1

std::string refusal(double value, const Range& range, Dimension dimension) {
    const std::string expected = range_text(range, dimension);
    return fmt::format("found {:g}, expected {}", value, expected.empty() ? "a finite number" : expected);
}

} // namespace

bool described_detail::MisfitSearch::uses(const FieldSpec& field) const noexcept {
    return field.used_when.empty() || std::find(field.used_when.begin(), field.used_when.end(), chosen) != field.used_when.end();
}

std::optional<std::string> refuse_number(const FieldSpec& field, double value) {
    if (field.value.range.contains(value) || field.none == value) return std::nullopt;
    return refusal(value, field.value.range, field.value.dimension);
}

std::optional<std::string> refuse_vector(const FieldSpec& field, const Vec3& value) {
    for (int axis = 0; axis < 3; ++axis) {
        const Column& column = field.value.columns[static_cast<std::size_t>(axis)];
        if (!column.range.contains(value[axis])) return refusal(value[axis], column.range, column.dimension);
    }
    return std::nullopt;
}

std::optional<std::string> refuse_direction(const Vec3& value) {
    if (std::abs(value.norm() - 1.0) <= kUnitLength) return std::nullopt;
    return fmt::format("found a length of {:g}, expected a direction of length 1", value.norm());
}

std::optional<std::string> refuse_choice(const FieldSpec& field, int value) {
    if (field.value.index_of(value) < field.value.choices.size()) return std::nullopt;
    return fmt::format("found {}, expected one of {}", value, fmt::join(field.value.choices, ", "));
}

} // namespace trocar::engine
