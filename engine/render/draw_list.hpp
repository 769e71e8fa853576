// Private to engine/render: a scene's surfaces and tubes in the GPU's memory.
#pragma once

#include "engine/render/gl_objects.hpp"
#include "engine/render/projection.hpp"
#include "engine/render/render_scene.hpp"

#include <array>

namespace trocar::engine {

struct DrawItem {
    GlVertexArray layout;
    GlBuffer vertices;
    GlBuffer indices;
    GLsizei index_count = 0;
    std::array<float, 3> colour = {}; // linear
    float opacity = 1.0F;
    float emphasis = 0.0F;
    bool fluoro_thickness = false;
    float attenuation = 0.0F; // 1/m

    [[nodiscard]] bool transparent() const noexcept { return opacity < 1.0F; }
};

/// What a scene's surfaces, tubes, targets and markers fill. Non-finite points are left out.
[[nodiscard]] Box3 find_bounds(const RenderScene& scene) noexcept;

/// thicken  tubes are at least RenderTube::min_radius_px wide, as the shaded picture wants and the X-ray picture does not
[[nodiscard]] std::vector<DrawItem> upload(const GlApi& gl, const RenderScene& scene, const Projection& view, bool thicken);

void draw(const GlApi& gl, const DrawItem& item);

/// sRGB 0..1 to linear, clamped.
[[nodiscard]] float to_linear(double srgb) noexcept;

} // namespace trocar::engine
