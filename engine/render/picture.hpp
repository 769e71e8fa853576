// An 8-bit RGB picture in memory, and its way to a PNG file.
#pragma once

#include "base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace trocar::engine {

/// Rows run from top to bottom, sRGB encoded.
struct Picture {
    int width = 0;                 // pixels
    int height = 0;                // pixels
    std::vector<std::uint8_t> rgb; // [height * width * 3]

    [[nodiscard]] const std::uint8_t* pixel(int x, int y) const noexcept {
        return rgb.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    }
    [[nodiscard]] std::uint8_t* pixel(int x, int y) noexcept {
        return rgb.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    }
};

/// The picture as the bytes of a PNG file (for a file, or for a report that carries its pictures inside).
/// failure  BadValue for an empty picture or one whose buffer does not fit its size
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_png(const Picture& picture);

/// Writes the file whole or not at all.
/// failure  as encode_png; CannotWrite when the disk is full or the folder read-only
[[nodiscard]] Result<void> write_png(const std::filesystem::path& path, const Picture& picture);

} // namespace trocar::engine
