// The X-ray pictures that OpenGL draws against the CPU projector: the same rays, the same attenuation, within what the picture's noise and its 8 bits allow.
#include "assets/anatomy/shapes.hpp"
#include "engine/fluoroscopy/projector.hpp"
#include "engine/render/renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

constexpr unsigned kEdge = 192, kBlock = 8;

/// What the CPU's rays let through, mean over blocks; seen from the source as OpenGL's camera is, not from the detector: mirrored.
std::vector<double> cpu_blocks(const XrayView& view, const ConeBeam& beam, const std::vector<TriMesh>& bodies, double attenuation) {
    Projector projector(beam);
    AttenuationSums sums(view.pixel_count(), 0);
    for (const TriMesh& body : bodies) projector.add({body.vertices, body.triangles, attenuation}, sums);
    std::vector<double> along;
    projector.attenuations(sums, along);
    std::vector<double> blocks((kEdge / kBlock) * (kEdge / kBlock), 0.0);
    for (unsigned y = 0; y < kEdge; ++y)
        for (unsigned x = 0; x < kEdge; ++x)
            blocks[y / kBlock * (kEdge / kBlock) + (kEdge - 1 - x) / kBlock] += std::exp(-along[y * kEdge + x]) / (kBlock * kBlock);
    return blocks;
}

/// The same of a picture, its tones undone as shaders/fluoroscopy.frag.glsl makes them: grey = 0.84 I vignette + 0.02.
std::vector<double> gl_blocks(const Picture& picture) {
    std::vector<double> blocks((kEdge / kBlock) * (kEdge / kBlock), 0.0);
    for (unsigned y = 0; y < kEdge; ++y)
        for (unsigned x = 0; x < kEdge; ++x) {
            const double u = (x + 0.5) / kEdge - 0.5, v = (y + 0.5) / kEdge - 0.5;
            const double t = std::clamp((std::hypot(u, v) - 0.35) / (1.15 - 0.35), 0.0, 1.0), vignette = 1.0 - 0.30 * t * t * (3.0 - 2.0 * t);
            const double grey = *picture.pixel(static_cast<int>(x), static_cast<int>(y)) / 255.0;
            blocks[y / kBlock * (kEdge / kBlock) + x / kBlock] += (grey - 0.02) / (0.84 * vignette) / (kBlock * kBlock);
        }
    return blocks;
}

TEST(GlAgreement, EveryContextsPictureIsTheProjectorsWithinTwoPercent) {
    const std::vector<TriMesh> bodies{anatomy::make_icosphere(Vec3(0.01, 0.0, 0.02), 0.05, 4), anatomy::make_icosphere(Vec3(-0.05, 0.02, -0.03), 0.02, 3)};
    constexpr double kAttenuation = 21.7; // 1/m, soft tissue
    XrayView view;
    view.pixels = {kEdge, kEdge};
    const ConeBeam beam = make_cone_beam(view, {0.4, -0.2});
    const std::vector<double> expected = cpu_blocks(view, beam, bodies, kAttenuation);
    Camera camera;
    camera.eye = beam.source;
    camera.look_at = beam.source + beam.along;
    camera.up = -beam.down;
    camera.field_of_view_rad = 2.0 * std::atan(0.5 * view.detector[1] / view.sid);
    RenderScene scene;
    for (const TriMesh& body : bodies) scene.surfaces.push_back({.vertices = body.vertices, .triangles = body.triangles, .attenuation = kAttenuation});
    unsigned contexts = 0;
    for (const ContextOptions& options : {ContextOptions{}, ContextOptions{.egl_library = "libNoSuchEgl.so.1"}}) {
        const auto renderer = Renderer::make(options);
        if (!renderer.ok()) continue;
        const Result<Picture> picture = (*renderer)->fluoroscopy(scene, camera, kEdge, kEdge);
        ASSERT_TRUE(picture.ok()) << picture.error().to_string();
        ++contexts;
        const std::vector<double> seen = gl_blocks(*picture);
        for (std::size_t k = 0; k < seen.size(); ++k)
            if (k / (kEdge / kBlock) < 18 || k % (kEdge / kBlock) > 9) // the scale bar is there
                EXPECT_NEAR(seen[k], expected[k], 0.02) << (*renderer)->context().renderer_name() << ", block " << k;
    }
    if (contexts == 0) GTEST_SKIP() << "no OpenGL here";
}

} // namespace
} // namespace trocar::engine
