#include "engine/scene/table.hpp"

#include <cmath>
#include <utility>

namespace trocar::engine {
namespace {

ValueSpec plain_value(ValueKind kind) {
    ValueSpec value;
    value.kind = kind;
    return value;
}

FieldSpec make_field(std::string_view key, ValueSpec value, std::string_view doc) {
    FieldSpec field;
    field.key = key;
    field.value = std::move(value);
    field.doc = doc;
    return field;
}

} // namespace

bool Range::contains(double value) const noexcept {
    return std::isfinite(value) && (above_least ? value > least : value >= least) && value <= most;
}

std::size_t ValueSpec::index_of(int value) const noexcept {
    for (std::size_t i = 0; i < choices.size(); ++i)
        if (value_of(i) == value) return i;
    return choices.size();
}

FieldSpec FieldSpec::required() && {
    is_required = true;
    return std::move(*this);
}

FieldSpec FieldSpec::default_in_doc() && {
    is_default_in_doc = true;
    return std::move(*this);
}

FieldSpec FieldSpec::by_default(DefaultValue value_if_absent) && {
    otherwise = value_if_absent;
    return std::move(*this);
}

FieldSpec FieldSpec::when(std::vector<std::string_view> discriminator_values) && {
    used_when = std::move(discriminator_values);
    return std::move(*this);
}

const FieldSpec* ObjectSpec::find(std::string_view key) const noexcept {
    for (const FieldSpec& field : fields)
        if (field.key == key) return &field;
    return nullptr;
}

std::vector<std::string_view> ObjectSpec::keys() const {
    std::vector<std::string_view> names;
    for (const FieldSpec& field : fields) names.push_back(field.key);
    return names;
}

FieldSpec number_field(std::string_view key, Dimension dimension, Range range, std::string_view doc) {
    ValueSpec value = plain_value(ValueKind::Number);
    value.dimension = dimension;
    value.range = range;
    return make_field(key, std::move(value), doc);
}

FieldSpec count_field(std::string_view key, double least, double most, std::string_view doc) {
    ValueSpec value = plain_value(ValueKind::Count);
    value.range = between(least, most);
    return make_field(key, std::move(value), doc);
}

FieldSpec flag_field(std::string_view key, std::string_view doc) { return make_field(key, plain_value(ValueKind::Flag), doc); }

FieldSpec text_field(std::string_view key, std::string_view doc) { return make_field(key, plain_value(ValueKind::Text), doc); }

FieldSpec path_field(std::string_view key, std::string_view doc) { return make_field(key, plain_value(ValueKind::Path), doc); }

FieldSpec choice_field(std::string_view key, std::vector<std::string_view> choices, std::string_view doc) {
    return make_field(key, choice_value(std::move(choices)), doc);
}

FieldSpec object_field(std::string_view key, const ObjectSpec& object, std::string_view doc) {
    return make_field(key, object_value(object), doc);
}

FieldSpec map_field(std::string_view key, ValueSpec element, std::string_view doc) {
    ValueSpec value = plain_value(ValueKind::Map);
    value.alternatives.push_back(std::move(element));
    return make_field(key, std::move(value), doc);
}

FieldSpec value_field(std::string_view key, ValueSpec value, std::string_view doc) { return make_field(key, std::move(value), doc); }

FieldSpec vector_field(std::string_view key, Dimension dimension, Range range, std::string_view doc) {
    return make_field(key, vector_value(dimension, range), doc);
}

ValueSpec vector_value(Dimension dimension, Range range) {
    ValueSpec value = plain_value(ValueKind::Vector);
    value.columns = {{"x", dimension, range}, {"y", dimension, range}, {"z", dimension, range}};
    return value;
}

ValueSpec choice_value(std::vector<std::string_view> choices) {
    ValueSpec value = plain_value(ValueKind::Choice);
    value.choices = std::move(choices);
    return value;
}

ValueSpec object_value(const ObjectSpec& object) {
    ValueSpec value = plain_value(ValueKind::Object);
    value.object = &object;
    return value;
}

ValueSpec rows_value(std::vector<Column> columns, std::size_t least_count, std::size_t most_count) {
    ValueSpec value = plain_value(ValueKind::Rows);
    value.columns = std::move(columns);
    value.least_count = least_count;
    value.most_count = most_count;
    return value;
}

ValueSpec list_value(ValueSpec element, std::size_t least_count) {
    ValueSpec value = plain_value(ValueKind::List);
    value.alternatives.push_back(std::move(element));
    value.least_count = least_count;
    return value;
}

ValueSpec any_value(std::vector<ValueSpec> alternatives) {
    ValueSpec value = plain_value(ValueKind::Alternatives);
    value.alternatives = std::move(alternatives);
    return value;
}

ValueSpec json_value() { return plain_value(ValueKind::Any); }

Range positive() noexcept { return above(0.0, std::numeric_limits<double>::infinity()); }

Range between(double least, double most) noexcept {
    Range range;
    range.least = least;
    range.most = most;
    return range;
}

Range above(double least, double most) noexcept {
    Range range = between(least, most);
    range.above_least = true;
    return range;
}

Range coordinate() noexcept { return between(-kMaxCoordinate, kMaxCoordinate); }

} // namespace trocar::engine
