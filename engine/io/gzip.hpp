// Packing for files that are kept: references, records.
#pragma once

#include "base/result.hpp"

#include <string>
#include <string_view>

namespace trocar::engine {

/// One gzip member without name or time: the same bytes for the same text. read_file_bytes unpacks it.
/// fails  ToolFailed when memory is short
[[nodiscard]] Result<std::string> gzip_bytes(std::string_view text);

} // namespace trocar::engine
