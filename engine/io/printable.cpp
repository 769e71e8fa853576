#include "engine/io/printable.hpp"

#include <fmt/format.h>

#include <iterator>

namespace trocar::engine {

namespace {

constexpr std::size_t kLongestName = 64;

/// Bytes of the control character that begins here; 0: none does.
std::size_t control_length(std::string_view text, std::size_t at) noexcept {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    if (byte(at) < 0x20 || byte(at) == 0x7f) return 1;
    return byte(at) == 0xc2 && at + 1 < text.size() && byte(at + 1) >= 0x80 && byte(at + 1) < 0xa0 ? 2 : 0;
}

bool is_plain(char c) noexcept {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
}

} // namespace

bool has_control_characters(std::string_view text) noexcept {
    for (std::size_t i = 0; i < text.size(); ++i)
        if (control_length(text, i) > 0) return true;
    return false;
}

std::string printable(std::string_view text) {
    std::string shown;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const std::size_t length = control_length(text, i);
        if (length == 0) {
            shown += text[i];
            continue;
        }
        i += length - 1;
        fmt::format_to(std::back_inserter(shown), "\\u{:04x}", static_cast<unsigned char>(text[i])); // U+0080 on: as the second byte
    }
    return shown;
}

std::string safe_file_name(std::string_view text) {
    std::string name(text.substr(0, kLongestName));
    for (char& c : name)
        if (!is_plain(c)) c = '_';
    return name.empty() ? "_" : name;
}

} // namespace trocar::engine
