// Reads a checked object into the struct that its description is of. An absent key leaves its member as the struct was made.
#pragma once

#include "engine/scene/described.hpp"
#include "engine/scene/reader.hpp"

#include <concepts>
#include <type_traits>

namespace trocar::engine {

template <class Keys>
[[nodiscard]] std::optional<Error> read_keys(const Reading& reading, typename Keys::Struct& s);

namespace described_detail {

template <class T>
void read_plain(const Reading& reading, const FieldSpec& field, T& member) {
    const Values& values = reading.values;
    if (!values.has(field.key)) return;
    if constexpr (std::is_same_v<T, bool>)
        member = field.value.kind == ValueKind::Choice ? values.choice(field.key) != 0 : values.flag(field.key);
    else if constexpr (std::is_same_v<T, double>)
        member = values.number(field.key);
    else if constexpr (std::is_enum_v<T>)
        member = static_cast<T>(values.choice(field.key));
    else if constexpr (std::is_integral_v<T>)
        member = values.count<T>(field.key);
    else if constexpr (std::is_same_v<T, Vec3>)
        member = values.vector(field.key);
    else if constexpr (std::is_same_v<T, std::filesystem::path>)
        member = checked_file(reading.context, values.text(field.key));
    else
        member = values.text(field.key);
}

template <class T>
std::optional<Error> read_entry(const Reading& reading, const Key<T>& one) {
    read_plain(reading, one.field, *one.member);
    return std::nullopt;
}
template <class T>
std::optional<Error> read_entry(const Reading& reading, const DirectionKey<T>& one) {
    if (!reading.values.has(one.field.key)) return std::nullopt;
    return read_direction(reading.context, reading.values, one.field.key, *one.member);
}
template <class Keys, class T, bool counts>
std::optional<Error> read_entry(const Reading& reading, const ObjectKey<Keys, T, counts>& one) {
    if (!reading.values.has(one.field.key)) return std::nullopt;
    const Values object = reading.values.object(one.field.key);
    const Reading inner{reading.context, object, reading.scene};
    if constexpr (std::is_same_v<T, typename Keys::Struct>)
        return read_keys<Keys>(inner, *one.member);
    else
        return read_keys<Keys>(inner, one.member->emplace());
}
template <class Keys, class T>
std::optional<Error> read_entry(const Reading& reading, const InlineKeys<Keys, T>& one) {
    return read_keys<Keys>(reading, *one.member);
}
template <class Read, class... T>
std::optional<Error> read_entry(const Reading& reading, const CustomKey<Read, T...>& one) {
    if constexpr (std::is_same_v<Read, ReadApart>)
        return std::nullopt;
    else
        return std::apply([&](auto*... member) { return one.read(reading, *member...); }, one.member);
}
template <class... T>
std::optional<Error> read_entry(const Reading&, const NoKey<T...>&) {
    return std::nullopt;
}

} // namespace described_detail

/// The first mistake, in the order of the description, that the table could not find.
template <class Keys>
std::optional<Error> read_keys(const Reading& reading, typename Keys::Struct& s) {
    const auto description = Keys::of(s);
    std::optional<Error> error;
    std::apply([&](const auto&... one) { ((error = described_detail::read_entry(reading, one)).has_value() || ...); }, description.entries);
    return error;
}

} // namespace trocar::engine
