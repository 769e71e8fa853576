#include "bench/chromatic_scenes.hpp"

#include "base/box.hpp"
#include "bench/contact_workloads.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Of the fold: pleats touch from the middle on.
constexpr std::size_t kFirstStep = 2 * kFoldSteps / 3;

} // namespace

std::size_t CullScene::triangle_count() const noexcept {
    std::size_t count = 0;
    for (const auto& surface : surfaces) count += surface.triangles.size();
    return count;
}

std::vector<collision::SurfaceMotion> CullScene::motions(std::size_t step) const {
    std::vector<collision::SurfaceMotion> all;
    for (const auto& surface : surfaces) all.push_back({&surface, frames.frame(step), frames.frame(step + 1)});
    return all;
}

std::vector<const collision::SurfaceTopology*> CullScene::topologies() const {
    std::vector<const collision::SurfaceTopology*> all;
    for (const auto& surface : surfaces) all.push_back(&surface);
    return all;
}

CullScene make_cull_scene(std::string name, FrameSequence frames) {
    CullScene scene;
    scene.name = std::move(name);
    scene.frames = std::move(frames);
    const auto& objects = scene.frames.objects;
    const std::int32_t count = objects.empty() ? 0 : *std::max_element(objects.begin(), objects.end()) + 1;
    for (std::int32_t object = 0; object < count; ++object) {
        std::vector<Triangle> own;
        for (const Triangle& t : scene.frames.triangles)
            if (objects[t[0]] == object) own.push_back(t);
        scene.surfaces.push_back(collision::make_topology(own, scene.frames.vertex_count()));
    }
    return scene;
}

CullScene make_cloth_scene(std::string name, std::size_t columns, std::size_t rows, std::size_t steps) {
    return make_cull_scene(std::move(name), make_folding_cloth(columns, rows, {kFirstStep, steps}));
}

CullScene make_curtains_scene(std::size_t columns, std::size_t rows, std::size_t steps) {
    const FrameSequence one = make_folding_cloth(columns, rows, {kFirstStep, steps});
    Box3 box;
    for (const Vec3& p : one.frame(0)) box.add(p);
    Vec3 extent = box.extent();
    int longest = 0;
    extent.maxCoeff(&longest);
    constexpr double kOverlap = 0.1; // of the length
    const Vec3 aside = (1.0 - kOverlap) * extent[longest] * Vec3::Unit(longest);
    FrameSequence two;
    two.name = "curtains";
    two.frame_count = one.frame_count;
    const auto vertices = static_cast<Index>(one.vertex_count());
    two.triangles = one.triangles;
    for (const Triangle& t : one.triangles) two.triangles.push_back({t[0] + vertices, t[1] + vertices, t[2] + vertices});
    two.objects.assign(vertices, 0);
    two.objects.resize(2 * std::size_t{vertices}, 1);
    for (std::size_t k = 0; k < one.frame_count; ++k) {
        for (const Vec3& p : one.frame(k)) two.positions.push_back(p);
        for (const Vec3& p : one.frame(k)) two.positions.push_back(p + aside);
    }
    return make_cull_scene("two curtains", std::move(two));
}

CullScene make_catheter_scene(std::size_t steps) {
    constexpr double kCell = 0.608e-3; // m: some 83,000 triangles
    CullScene scene = make_cull_scene("catheter 10K in vessel 83K", make_bending_artery(kCell, steps));
    scene.within = false;
    scene.between = true;
    scene.paper_ms = "60-90";
    return scene;
}

CullScene make_catheter_alone_scene(std::size_t steps) {
    CullScene scene = make_catheter_scene(steps);
    scene.name = "catheter 10K alone";
    scene.surfaces.erase(scene.surfaces.begin());
    scene.within = true;
    scene.between = false;
    scene.paper_ms = "";
    return scene;
}

} // namespace trocar::engine
