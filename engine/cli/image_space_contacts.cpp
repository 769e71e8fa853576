#include "engine/cli/image_space_contacts.hpp"

#include "collision/culling/cull_twin.hpp"
#include "collision/culling/cullide.hpp"
#include "engine/render/gl_cull_backend.hpp"
#include "engine/render/hand_over.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

namespace trocar::engine {

namespace {

struct Joined {
    std::vector<Triangle> triangles;
    std::vector<Vec3> positions;
    std::size_t first_count = 0; // triangles of the first surface
};

Joined join(std::span<const collision::SurfaceTopology> surfaces, std::span<const std::vector<Vec3>> positions) {
    Joined all;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        const auto shift = static_cast<Index>(all.positions.size());
        for (const Triangle& t : surfaces[i].triangles) all.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
        all.positions.insert(all.positions.end(), positions[i].begin(), positions[i].end());
        if (i == 0) all.first_count = all.triangles.size();
    }
    return all;
}

/// Prunes in image space, by OpenGL where that is requested and available.
/// returns   ids that are left
std::vector<Index> prune(const Joined& all, const CrossingOptions& options, CrossingAnswer& answer) {
    StopWatch watch;
    collision::ImageSpaceCuller culler(all.triangles, all.positions.size());
    answer.colours = culler.sets().count();
    std::unique_ptr<collision::CullBackend> backend;
    if (options.culling == CullMethod::Gl) {
        auto gl = GlCullBackend::make(options.contexts);
        if (gl.ok())
            backend = std::move(gl).value();
        else
            answer.notes.push_back("culling on the CPU instead of OpenGL: " + gl.error().message);
    }
    if (!backend) backend = std::make_unique<collision::CpuCullBackend>();
    answer.build_ms = watch.lap_ms();

    collision::ImageSpacePlan plan = options.plan;
    HandOver hand_over(all.triangles, all.positions);
    plan.watch = [&](const collision::ImageSpacePass& pass) { hand_over.see(pass); };
    plan.go_on = [&](const collision::ImageSpacePass& pass) { return hand_over.go_on(pass); };
    auto ids = culler.find_colliding_set(all.positions, plan, *backend);
    if (!ids.ok()) {
        answer.notes.push_back("culling on the CPU after all: " + ids.error().message);
        backend = std::make_unique<collision::CpuCullBackend>();
        ids = culler.find_colliding_set(all.positions, plan, *backend);
    }
    answer.culler = backend->name();
    answer.passes.assign(culler.passes().begin(), culler.passes().end());
    for (const collision::ImageSpacePass& pass : answer.passes)
        if (pass.lowered_for_memory > 0)
            answer.notes.push_back(
                fmt::format("{} has no memory for larger pictures: {} x {} pixels", answer.culler, pass.resolution, pass.resolution));
    answer.cull_ms = watch.lap_ms();
    return std::move(*ids);
}

std::vector<Index> prune_as_paper(const Joined& all, CrossingAnswer& answer) {
    StopWatch watch;
    collision::Cullide cullide(all.triangles, collision::make_patch_hierarchy(all.triangles, all.positions.size()));
    answer.build_ms = watch.lap_ms();
    auto ids = cullide.find_colliding_set(all.positions, {});
    answer.culler = "CPU reference, by pixel centres";
    answer.notes.emplace_back("as in the image-space paper: crossings smaller than a pixel, or seen edge-on, can be missing");
    for (const collision::CullidePass& pass : cullide.passes())
        answer.passes.push_back({.direction = Vec3::Unit(static_cast<int>(answer.passes.size() % 3)),
                                 .triangles = pass.triangles,
                                 .triangles_left = pass.triangles,
                                 .questions = pass.queries,
                                 .resolution = collision::CullidePlan{}.resolution});
    for (std::size_t k = 0; k < answer.passes.size(); ++k)
        answer.passes[k].triangles_left = k + 1 < answer.passes.size() ? answer.passes[k + 1].triangles : ids.size();
    answer.cull_ms = watch.lap_ms();
    return ids;
}

} // namespace

CrossingAnswer find_crossing_triangles(std::span<const collision::SurfaceTopology> surfaces, std::span<const std::vector<Vec3>> positions,
                                       const CrossingOptions& options) {
    CrossingAnswer answer;
    const Joined all = join(surfaces, positions);
    answer.triangles = all.triangles.size();
    const std::vector<Index> ids = options.as_paper ? prune_as_paper(all, answer) : prune(all, options, answer);
    answer.left = ids.size();
    StopWatch watch;

    const auto first = static_cast<Index>(all.first_count);
    for (const auto& [a, b] : collision::find_crossings(all.triangles, all.positions, ids)) {
        const bool same = (a < first) == (b < first);
        if (!(same ? options.within : options.between)) continue;
        ContactRecord row;
        row.kind = ContactKind::TT;
        row.body_a = a < first ? 0 : 1;
        row.body_b = b < first ? 0 : 1;
        row.feature_a0 = a < first ? a : a - first;
        row.feature_b0 = b < first ? b : b - first;
        answer.rows.push_back(row);
    }
    answer.narrow_ms = watch.lap_ms();
    return answer;
}

} // namespace trocar::engine
