// The ranges of described keys, checked in a struct in memory: one that a program has made or changed.
#pragma once

#include "engine/scene/described.hpp"

#include <concepts>
#include <optional>
#include <string>
#include <type_traits>

namespace trocar::engine {

/// What is wrong with a member.
struct Misfit {
    std::string key;     // as in "fixed.fraction"
    std::string message; // "found nan, expected 0 to 2"
};

/// The first member that its key's range refuses, or that is no choice; a key that the discriminator leaves without use is not looked at.
/// A default outside its range, which says "none", is accepted.
template <class Keys>
[[nodiscard]] std::optional<Misfit> find_misfit(const typename Keys::Struct& s);

/// As a message; nothing where the value fits. field: of the table, with its default.
[[nodiscard]] std::optional<std::string> refuse_number(const FieldSpec& field, double value);
[[nodiscard]] std::optional<std::string> refuse_vector(const FieldSpec& field, const Vec3& value);
[[nodiscard]] std::optional<std::string> refuse_direction(const Vec3& value);
[[nodiscard]] std::optional<std::string> refuse_choice(const FieldSpec& field, int value);

namespace described_detail {

/// Of one struct: goes through the entries, keeps the first complaint.
struct MisfitSearch {
    const ObjectSpec& table;
    std::string_view chosen = {}; // of the discriminator
    std::optional<Misfit> found = {};

    [[nodiscard]] bool uses(const FieldSpec& field) const noexcept;
    void take(std::string_view key, std::optional<std::string> message) {
        if (message && !found) found = Misfit{std::string(key), std::move(*message)};
    }

    template <class T>
    void choose(const Key<T>& one) {
        if constexpr (std::is_enum_v<T>)
            if (one.field.key == table.discriminator)
                if (const std::size_t i = one.field.value.index_of(static_cast<int>(*one.member)); i < one.field.value.choices.size())
                    chosen = one.field.value.choices[i];
    }
    void choose(const auto&) {}

    template <class T>
    void look(const Key<T>& one) {
        using Value = std::remove_const_t<T>;
        if (!uses(one.field)) return;
        if constexpr (std::is_enum_v<Value>)
            take(one.field.key, refuse_choice(one.field, static_cast<int>(*one.member)));
        else if constexpr (std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>)
            take(one.field.key, refuse_number(*table.find(one.field.key), static_cast<double>(*one.member)));
        else if constexpr (std::is_same_v<Value, Vec3>)
            take(one.field.key, refuse_vector(one.field, *one.member));
    }
    template <class T>
    void look(const DirectionKey<T>& one) {
        if (uses(one.field)) take(one.field.key, refuse_direction(*one.member));
    }
    template <class Keys, class T, bool counts>
    void look(const ObjectKey<Keys, T, counts>& one) {
        if (!uses(one.field) || found) return;
        std::optional<Misfit> inner;
        if constexpr (std::is_same_v<std::remove_const_t<T>, typename Keys::Struct>)
            inner = find_misfit<Keys>(*one.member);
        else if (one.member->has_value())
            inner = find_misfit<Keys>(**one.member);
        if (inner) found = Misfit{std::string(one.field.key) + "." + inner->key, std::move(inner->message)};
    }
    template <class Keys, class T>
    void look(const InlineKeys<Keys, T>& one) {
        if (!found) found = find_misfit<Keys>(*one.member);
    }
    void look(const auto&) {} // customs: checked by whoever knows them
};

} // namespace described_detail

template <class Keys>
std::optional<Misfit> find_misfit(const typename Keys::Struct& s) {
    const auto description = Keys::of(s);
    described_detail::MisfitSearch search{table_of<Keys>()};
    std::apply([&](const auto&... one) { (search.choose(one), ...), (search.look(one), ...); }, description.entries);
    return std::move(search.found);
}

} // namespace trocar::engine
