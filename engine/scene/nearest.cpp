#include "engine/scene/nearest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace trocar::engine {
namespace {

/// Names beyond this length are not compared letter by letter.
constexpr std::size_t kMaxWord = 200;

/// A message lists at most this many names.
constexpr std::size_t kMaxListed = 40;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

} // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
    a = a.substr(0, kMaxWord);
    b = b.substr(0, kMaxWord);
    std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const bool same = lower(a[i - 1]) == lower(b[j - 1]);
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0U : 1U)});
            const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
            if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
        }
        std::swap(before, last);
        std::swap(last, row);
    }
    return last[b.size()];
}

std::string_view find_nearest(std::string_view word, std::span<const std::string_view> names) {
    std::string_view best;
    std::size_t best_distance = 0;
    for (const std::string_view name : names) {
        const std::size_t distance = edit_distance(word, name);
        if (best.data() != nullptr && distance >= best_distance) continue;
        best = name;
        best_distance = distance;
    }
    return best;
}

std::string suggest(std::string_view kind, std::string_view word, std::span<const std::string_view> names) {
    if (names.empty()) return "there are none here";
    std::string text = "nearest known " + std::string(kind) + ": \"" + std::string(find_nearest(word, names)) + "\" (known: ";
    for (std::size_t i = 0; i < std::min(names.size(), kMaxListed); ++i) text += (i > 0 ? ", " : "") + std::string(names[i]);
    if (names.size() > kMaxListed) text += " and " + std::to_string(names.size() - kMaxListed) + " more";
    return text + ")";
}

std::string refuse_unknown(std::string_view kind, std::string_view name, std::span<const std::string_view> known) {
    return fmt::format("found the unknown {} \"{:.60}\"; {}", kind, name, suggest(kind, name, known));
}

} // namespace trocar::engine
