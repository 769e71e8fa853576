// Text from files and command lines, made fit for a terminal and for the name of a file.
#pragma once

#include <string>
#include <string_view>

namespace trocar::engine {

/// Below space, DEL, or U+0080 to U+009F in UTF-8: a terminal obeys them, and a zero byte ends a message.
[[nodiscard]] bool has_control_characters(std::string_view text) noexcept;

/// Control characters as \u001b.
[[nodiscard]] std::string printable(std::string_view text);

/// One component of a path: letters, digits, - and _, at most 64; every other byte is a _. Never empty, never a way elsewhere.
[[nodiscard]] std::string safe_file_name(std::string_view text);

} // namespace trocar::engine
