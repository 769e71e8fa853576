// Numbers in messages.
#pragma once

#include <charconv>
#include <string>

namespace trocar {

/// Six digits whatever its size: 0.25, 1e+30.
[[nodiscard]] inline std::string short_number(double number) {
    char text[32]; // the longest has 13
    return {text, std::to_chars(text, text + sizeof text, number, std::chars_format::general, 6).ptr};
}

} // namespace trocar
