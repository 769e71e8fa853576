// How a key of a scene or a recipe is described: type, dimension, range, default, one sentence. One such table per
// object drives the checks, the reader, the JSON Schema and the reference page, so that they cannot disagree.
#pragma once

#include "base/vec.hpp"
#include "engine/scene/units.hpp"

#include <initializer_list>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace trocar::engine {

enum class ValueKind : std::uint8_t {
    Number,
    Count, // integer
    Flag,
    Text,
    Path,   // name of a file that exists
    Choice, // one of `choices`
    Vector, // a number per column
    Rows,   // list of vectors: a number per column in each
    List,   // of alternatives.front()
    Object,
    Map,          // of alternatives.front(), by name
    Alternatives, // told apart by JSON type; objects by their marker
    Any,          // any JSON value: checked by whoever uses it
};

/// Numbers in SI. Outside [least, most] a value is refused; outside the usual range it is questioned.
struct Range {
    double least = -std::numeric_limits<double>::infinity();
    double most = std::numeric_limits<double>::infinity();
    bool above_least = false; // least itself is refused
    double usual_least = -std::numeric_limits<double>::infinity();
    double usual_most = std::numeric_limits<double>::infinity();
    std::string_view what = {}; // what the range is about, as in "soft tissue is 900 to 1200 kg/m^3"

    /// false of what is not finite
    [[nodiscard]] bool contains(double value) const noexcept;
};

struct Column {
    std::string_view name;
    Dimension dimension = Dimension::None;
    Range range = {};
};

struct ObjectSpec;

struct ValueSpec {
    ValueKind kind = ValueKind::Number;
    Dimension dimension = Dimension::None; // Number; Choice of a unit
    Range range = {};                      // Number, Count
    std::vector<std::string_view> choices; // Choice
    std::vector<int> choice_values = {};   // Choice: what a member holds for each; empty: its index
    std::vector<Column> columns;           // Vector, Rows
    std::size_t least_count = 0;           // Rows, List
    std::size_t most_count = std::numeric_limits<std::size_t>::max();
    const ObjectSpec* object = nullptr;  // Object
    std::vector<ValueSpec> alternatives; // Alternatives; List, Map: the element alone
    bool any_names = false;              // Map: names may hold any characters, as JSON pointers do

    /// Choice: what a member holds for the choice at that index, and the other way round; choices.size() where it is none.
    [[nodiscard]] int value_of(std::size_t index) const noexcept {
        return choice_values.empty() ? static_cast<int>(index) : choice_values[index];
    }
    [[nodiscard]] std::size_t index_of(int value) const noexcept;
};

using DefaultValue = std::variant<std::monostate, bool, double, std::string_view, Vec3>;

struct FieldSpec {
    std::string_view key;
    ValueSpec value;
    std::string_view doc;
    bool is_required = false;
    DefaultValue otherwise = {};                  // SI; monostate: nothing, `doc` says what happens
    std::vector<std::string_view> used_when = {}; // values of the object's discriminator that use this key; empty: all
    bool is_default_in_doc = false;               // the table shows no default
    std::optional<double> none = {}; // a default outside the range: "none" in a struct, which a file says by leaving the key out

    [[nodiscard]] FieldSpec required() &&;
    [[nodiscard]] FieldSpec default_in_doc() &&;
    [[nodiscard]] FieldSpec by_default(DefaultValue value_if_absent) &&;
    [[nodiscard]] FieldSpec when(std::vector<std::string_view> discriminator_values) &&;
};

struct ObjectSpec {
    std::string_view name; // of the object in schema and reference
    std::string_view doc;
    std::string_view marker;        // key that tells this alternative from the others; empty: no alternative
    std::string_view discriminator; // key whose value decides which other keys are used; empty: none
    std::vector<FieldSpec> fields;
    std::string_view decided_by = {}; // key beside the object that gives an absent discriminator another value than its default: who
                                      // reads that key refuses the keys that are not used then; empty: none

    [[nodiscard]] const FieldSpec* find(std::string_view key) const noexcept;
    [[nodiscard]] std::vector<std::string_view> keys() const;
};

[[nodiscard]] FieldSpec number_field(std::string_view key, Dimension dimension, Range range, std::string_view doc);
[[nodiscard]] FieldSpec count_field(std::string_view key, double least, double most, std::string_view doc);
[[nodiscard]] FieldSpec flag_field(std::string_view key, std::string_view doc);
[[nodiscard]] FieldSpec text_field(std::string_view key, std::string_view doc);
[[nodiscard]] FieldSpec path_field(std::string_view key, std::string_view doc);
/// Of an enum: the choices are its values, in its order.
[[nodiscard]] FieldSpec choice_field(std::string_view key, std::vector<std::string_view> choices, std::string_view doc);
/// Choices in an order that is not the enum's, or of a bool.
template <class T>
[[nodiscard]] FieldSpec choice_field(std::string_view key, std::initializer_list<std::pair<std::string_view, T>> choices,
                                     std::string_view doc) {
    std::vector<std::string_view> words;
    std::vector<int> values;
    for (const auto& [word, value] : choices) words.push_back(word), values.push_back(static_cast<int>(value));
    FieldSpec field = choice_field(key, std::move(words), doc);
    field.value.choice_values = std::move(values);
    return field;
}
[[nodiscard]] FieldSpec object_field(std::string_view key, const ObjectSpec& object, std::string_view doc);
[[nodiscard]] FieldSpec map_field(std::string_view key, ValueSpec element, std::string_view doc);
[[nodiscard]] FieldSpec value_field(std::string_view key, ValueSpec value, std::string_view doc);
/// Three numbers x, y, z.
[[nodiscard]] FieldSpec vector_field(std::string_view key, Dimension dimension, Range range, std::string_view doc);

[[nodiscard]] ValueSpec vector_value(Dimension dimension, Range range);
[[nodiscard]] ValueSpec choice_value(std::vector<std::string_view> choices);
[[nodiscard]] ValueSpec object_value(const ObjectSpec& object);
[[nodiscard]] ValueSpec rows_value(std::vector<Column> columns, std::size_t least_count, std::size_t most_count);
[[nodiscard]] ValueSpec list_value(ValueSpec element, std::size_t least_count);
[[nodiscard]] ValueSpec any_value(std::vector<ValueSpec> alternatives);
[[nodiscard]] ValueSpec json_value();

/// Positions beyond this are a mistaken unit.
inline constexpr double kMaxCoordinate = 100.0; // m

[[nodiscard]] Range positive() noexcept;
[[nodiscard]] Range between(double least, double most) noexcept;
/// least itself excluded
[[nodiscard]] Range above(double least, double most) noexcept;
[[nodiscard]] Range coordinate() noexcept;

} // namespace trocar::engine
