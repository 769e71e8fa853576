// A small scene for the picture tests: a transparent ball with a transparent vessel and an opaque rod inside.
#pragma once

#include "assets/anatomy/shapes.hpp"
#include "engine/render/renderer.hpp"

#include <array>
#include <cstdlib>

namespace trocar::engine::test {

struct SmallScene {
    TriMesh organ = anatomy::make_icosphere(Vec3::Zero(), 0.05, 4);
    TriMesh vessel = anatomy::make_capsule(Vec3(-0.04, 0.0, -0.02), Vec3(0.04, 0.0, 0.02), 0.008);
    TriMesh rod = anatomy::make_capsule(Vec3(-0.03, 0.0, -0.015), Vec3(0.03, 0.0, 0.015), 0.002);

    [[nodiscard]] RenderSurface organ_surface() const {
        return {.vertices = organ.vertices, .triangles = organ.triangles, .colour = palette::kLiver, .opacity = 0.3};
    }
    [[nodiscard]] RenderSurface vessel_surface() const {
        return {.vertices = vessel.vertices,
                .triangles = vessel.triangles,
                .colour = palette::kArtery,
                .opacity = 0.4,
                .attenuation = palette::kContrastAttenuation};
    }
    [[nodiscard]] RenderSurface rod_surface() const {
        return {.vertices = rod.vertices,
                .triangles = rod.triangles,
                .colour = palette::kInstrument,
                .attenuation = palette::kInstrumentAttenuation};
    }
    [[nodiscard]] RenderScene scene() const {
        RenderScene scene;
        scene.surfaces = {organ_surface(), vessel_surface(), rod_surface()};
        return scene;
    }
    [[nodiscard]] Camera camera() const { return frame_camera(organ.bounds(), {.aspect = 4.0 / 3.0}); }
};

inline constexpr int kWidth = 320;
inline constexpr int kHeight = 240;

struct Difference {
    double mean = 0.0; // of 255
    int worst = 0;
};
[[nodiscard]] inline Difference compare(const Picture& a, const Picture& b) {
    Difference difference;
    if (a.rgb.size() != b.rgb.size() || a.rgb.empty()) return {255.0, 255};
    for (std::size_t i = 0; i < a.rgb.size(); ++i) {
        const int d = std::abs(int{a.rgb[i]} - int{b.rgb[i]});
        difference.mean += d;
        difference.worst = std::max(difference.worst, d);
    }
    difference.mean /= static_cast<double>(a.rgb.size());
    return difference;
}

/// A renderer on the first context there is, or nullptr on a machine without any.
[[nodiscard]] inline std::unique_ptr<Renderer> any_renderer() {
    Result<std::unique_ptr<Renderer>> renderer = Renderer::make();
    return renderer ? std::move(renderer).value() : nullptr;
}

} // namespace trocar::engine::test

#define REQUIRE_RENDERER(name)                                                                                                             \
    const auto name = ::trocar::engine::test::any_renderer();                                                                              \
    if (name == nullptr) GTEST_SKIP() << "no OpenGL 4.5 on this machine: install libegl1 libgl1-mesa-dri"
