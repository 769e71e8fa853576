// A scene's structs described once. A description lists the keys of an object with the members that hold their values:
//
//     struct ContactKeys {
//         using Struct = ContactSpec;
//         static auto of(auto& s) {
//             return described({"contact", "Contact and response."},
//                              key(s.margin, number_field("margin", Dimension::Length, between(0.0, 0.05), "Coarse contacts ...")));
//         }
//     };
//     static_assert(describes_all<ContactKeys>);
//
// The table (and with it check, schema and reference page), the reader (read_keys.hpp) and the check of a struct in memory
// (check_keys.hpp) are made from it. Defaults are those of a default-constructed struct.
#pragma once

#include "base/aggregate.hpp"
#include "engine/scene/table.hpp"

#include <concepts>
#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

namespace trocar::engine {

/// One member, one key. What is read, and the default, follow from the member's type: double, bool, integer, enum (by the choice's
/// value), Vec3, text, path.
template <class T>
struct Key {
    static constexpr std::size_t members = 1;
    T* member;
    FieldSpec field;
};

/// A Vec3 of any length in the file, of length 1 in the member.
template <class T>
struct DirectionKey {
    static constexpr std::size_t members = 1;
    T* member;
    FieldSpec field;
};

/// An object with a description of its own. An optional member is made where the key is present.
/// counts   false: a part of the struct itself, which the part's description counts
template <class Keys, class T, bool counts>
struct ObjectKey {
    static constexpr std::size_t members = counts ? 1 : 0;
    T* member;
    FieldSpec field;
};

/// A struct whose keys stand among those of the struct that it is in.
template <class Keys, class T>
struct InlineKeys {
    static constexpr std::size_t members = 1;
    T* member;
};

/// More than one value of one type: `read` fills the members, and is called whether the key is present or not.
template <class Read, class... T>
struct CustomKey {
    static constexpr std::size_t members = sizeof...(T);
    FieldSpec field;
    Read read;
    std::tuple<T*...> member;
};

/// Members that no key fills directly: derived, or of something outside the object.
template <class... T>
struct NoKey {
    static constexpr std::size_t members = sizeof...(T);
    std::tuple<T*...> member;
};

template <class T>
[[nodiscard]] Key<T> key(T& member, FieldSpec field) {
    return {&member, std::move(field)};
}
template <class T>
[[nodiscard]] DirectionKey<T> direction_key(T& member, FieldSpec field) {
    return {&member, std::move(field)};
}
template <class Keys, class T>
[[nodiscard]] ObjectKey<Keys, T, true> object_key(T& member, FieldSpec field) {
    return {&member, std::move(field)};
}
template <class Keys, class T>
[[nodiscard]] ObjectKey<Keys, T, false> part_key(T& whole, FieldSpec field) {
    return {&whole, std::move(field)};
}
template <class Keys, class T>
[[nodiscard]] InlineKeys<Keys, T> inline_keys(T& member) {
    return {&member};
}
template <class Read, class... T>
[[nodiscard]] CustomKey<Read, T...> custom_key(FieldSpec field, Read read, T&... member) {
    return {std::move(field), read, {&member...}};
}
/// In place of a reading function: whoever reads the object does it, before or after the other keys.
struct ReadApart {};
inline constexpr ReadApart kReadApart{};

template <class... T>
[[nodiscard]] NoKey<T...> no_key(T&... member) {
    return {{&member...}};
}

/// Of an object: see ObjectSpec.
struct About {
    std::string_view name, doc, marker = {}, discriminator = {}, decided_by = {};
};

template <class... Entry>
struct Description {
    static constexpr std::size_t members = (Entry::members + ... + 0);
    About about;
    std::tuple<Entry...> entries;
};

template <class... Entry>
[[nodiscard]] Description<Entry...> described(About about, Entry... entries) {
    return {about, {std::move(entries)...}};
}

/// Members that a description names.
template <class Keys>
inline constexpr std::size_t described_members = decltype(Keys::of(std::declval<typename Keys::Struct&>()))::members;

/// Is every member of the first description's struct in exactly one of these descriptions? Beside every description stands a
/// static_assert of this: a member that is in none is a mistake, and does not compile. Its key belongs there, or no_key.
template <class First, class... Others>
inline constexpr bool
    describes_all = described_members<First> + (described_members<Others> + ... + 0) == member_count<typename First::Struct>;

/// The same where the members of one nested struct are described among the others, each by itself.
template <class Nested, class First, class... Others>
inline constexpr bool describes_all_with =
    described_members<First> + (described_members<Others> + ... + 0) == member_count<typename First::Struct> + member_count<Nested> - 1;

namespace described_detail {

/// The struct's value as the table's default; nothing where the key's sentence says what happens.
template <class T>
void take_default(FieldSpec& field, const T& value) {
    if (field.is_required || field.is_default_in_doc) return;
    if (field.value.kind == ValueKind::Choice) {
        if constexpr (std::is_enum_v<T> || std::is_same_v<T, bool>)
            field.otherwise = field.value.choices[field.value.index_of(static_cast<int>(value))];
    } else if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, Vec3>)
        field.otherwise = value;
    else if constexpr (std::is_arithmetic_v<T>) {
        const double number = static_cast<double>(value);
        if (field.value.range.contains(number))
            field.otherwise = number;
        else
            field.none = number;
    }
}

template <class T>
void add_field(ObjectSpec& table, const Key<T>& one) {
    take_default(table.fields.emplace_back(one.field), *one.member);
}
template <class T>
void add_field(ObjectSpec& table, const DirectionKey<T>& one) {
    take_default(table.fields.emplace_back(one.field), *one.member);
}
template <class Keys, class T, bool counts>
void add_field(ObjectSpec& table, const ObjectKey<Keys, T, counts>& one) {
    table.fields.push_back(one.field);
}
template <class Read, class... T>
void add_field(ObjectSpec& table, const CustomKey<Read, T...>& one) {
    table.fields.push_back(one.field);
}
template <class... T>
void add_field(ObjectSpec&, const NoKey<T...>&) {}
template <class Keys, class T>
void add_field(ObjectSpec& table, const InlineKeys<Keys, T>& one) {
    const auto description = Keys::of(*one.member);
    std::apply([&](const auto&... inner) { (add_field(table, inner), ...); }, description.entries);
}

} // namespace described_detail

/// The table that a description makes.
template <class Keys>
[[nodiscard]] const ObjectSpec& table_of() {
    static const ObjectSpec table = [] {
        typename Keys::Struct usual{};
        const auto description = Keys::of(usual);
        const About& about = description.about;
        ObjectSpec made{about.name, about.doc, about.marker, about.discriminator, {}, about.decided_by};
        std::apply([&](const auto&... one) { (described_detail::add_field(made, one), ...); }, description.entries);
        return made;
    }();
    return table;
}

} // namespace trocar::engine
