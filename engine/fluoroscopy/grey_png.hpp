// Grey pictures of 8 or 16 bits as PNG files.
#pragma once

#include "engine/fluoroscopy/detector.hpp"

#include "base/result.hpp"

#include <filesystem>
#include <string>

namespace trocar::engine {

/// fails     BadValue where the values do not fit the size
[[nodiscard]] Result<std::string> encode_grey_png(const GreyFrame& frame);

/// Writes the file whole or not at all.
[[nodiscard]] Result<void> write_grey_png(const std::filesystem::path& path, const GreyFrame& frame);

} // namespace trocar::engine
