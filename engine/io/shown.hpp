// Text from files and users, shortened for one line of an error message.
#pragma once

#include <string>
#include <string_view>

namespace trocar::engine {

/// The first 40 characters, those that a terminal might interpret shown as '?'.
[[nodiscard]] inline std::string shown(std::string_view text) {
    constexpr std::size_t kMost = 40;
    std::string out(text.substr(0, kMost));
    for (char& c : out)
        if (c < ' ' || c > '~') c = '?';
    return text.size() > kMost ? out + "..." : out;
}

/// Without the blanks around it.
[[nodiscard]] constexpr std::string_view trim(std::string_view text) noexcept {
    constexpr std::string_view kBlanks = " \t\r\v\f";
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == text.npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

} // namespace trocar::engine
