// Private to engine/render: what lies over a finished picture: targets, contacts, colour bar, scale bar. Painted on the CPU,
// so that it is the same on every driver.
#pragma once

#include "engine/render/picture.hpp"
#include "engine/render/projection.hpp"
#include "engine/render/render_scene.hpp"

namespace trocar::engine {

void draw_targets(const RenderScene& scene, const Projection& view, Picture& picture);
void draw_target_rings(const RenderScene& scene, const Projection& view, Picture& picture); // for the X-ray picture
void draw_markers(const RenderScene& scene, const Projection& view, Picture& picture);
void draw_colour_bar(const RenderScene& scene, Picture& picture);
/// distance  along the view at which the bar's length holds, m
void draw_scale_bar(const Projection& view, double distance, Picture& picture);

/// The scene's marker_range, or the next of 1, 2, 5 times a power of ten above its deepest marker. > 0.
[[nodiscard]] double find_marker_range(const RenderScene& scene) noexcept;

} // namespace trocar::engine
