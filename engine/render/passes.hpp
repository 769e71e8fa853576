// Private to engine/render: the passes of both pictures, tile by tile.
#pragma once

#include "base/result.hpp"
#include "engine/render/draw_list.hpp"
#include "engine/render/picture.hpp"

#include <span>

namespace trocar::engine {

/// Programs of one context.
struct Programs {
    GLuint opaque = 0;
    GLuint layer = 0;
    GLuint resolve = 0;
    GLuint shaded = 0;
    GLuint thickness = 0;
    GLuint transmit = 0;
    GLuint fluoroscopy = 0;
};
[[nodiscard]] Result<Programs> make_programs(const GlApi& gl);

/// What a picture's passes share. The context is current for as long as it lives.
struct PassContext {
    const GlApi& gl;
    const Programs& programs;
    const Projection& view;
    std::span<const DrawItem> items;
    GLuint empty_layout; // a vertex array without attributes, for full-screen passes
};

/// Part of the picture, in pixels from its lower left corner.
struct Tile {
    int x, y, width, height;
};

/// A tile larger than this is split: its lists then hold eight transparent layers everywhere, and 26 MB of targets do.
inline constexpr int kMaxTilePixels = 1 << 18;
inline constexpr int kMaxTileSide = 4096;

/// Draw the picture's part into `picture`.
/// failure  ToolFailed: out of memory, or (shaded) more transparent layers than fit even in a small tile
[[nodiscard]] Result<void> draw_shaded(const PassContext& pass, Picture& picture);
[[nodiscard]] Result<void> draw_fluoroscopy(const PassContext& pass, Picture& picture);

} // namespace trocar::engine
