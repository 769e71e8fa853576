// Pieces of an HTML page.
#pragma once

#include <string>
#include <string_view>

namespace trocar::engine {

/// Text with <, >, &, and both quotes escaped; control characters and bytes that are not UTF-8 become U+FFFD.
[[nodiscard]] std::string escape_html(std::string_view text);

/// RFC 4648, with padding.
[[nodiscard]] std::string encode_base64(std::string_view bytes);

} // namespace trocar::engine
