// Which known name a mistyped one was probably meant to be.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace trocar::engine {

/// Fewest insertions, removals, replacements and swaps of neighbours that turn one word into the other, letter case
/// aside. source  Damerau 1964, "optimal string alignment" form
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The first of the names with the smallest distance; empty where there are none.
[[nodiscard]] std::string_view find_nearest(std::string_view word, std::span<const std::string_view> names);

/// `nearest known X: "name" (known: a, b, c)`, or `there are none` when there are none.
[[nodiscard]] std::string suggest(std::string_view kind, std::string_view word, std::span<const std::string_view> names);

/// `found the unknown X "name"; nearest known ...`
[[nodiscard]] std::string refuse_unknown(std::string_view kind, std::string_view name, std::span<const std::string_view> known);

} // namespace trocar::engine
