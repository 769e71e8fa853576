#include "engine/cli/image_space_contacts.hpp"

#include "collision/cull_twin.hpp"
#include "engine/gpu/gl_cull_backend.hpp"
#include "engine/time/clock.hpp"

namespace seldinger::engine {

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

} // namespace

CrossingAnswer find_crossing_triangles(std::span<const collision::SurfaceTopology> surfaces, std::span<const std::vector<Vec3>> positions,
                                       const CrossingOptions& options) {
    CrossingAnswer answer;
    StopWatch watch;
    const Joined all = join(surfaces, positions);
    collision::ImageSpaceCuller culler(all.triangles, all.positions.size());
    answer.triangles = all.triangles.size();
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

    auto ids = culler.find_colliding_set(all.positions, options.plan, *backend);
    if (!ids.ok()) {
        answer.notes.push_back("culling on the CPU after all: " + ids.error().message);
        backend = std::make_unique<collision::CpuCullBackend>();
        ids = culler.find_colliding_set(all.positions, options.plan, *backend);
    }
    answer.culler = backend->name();
    answer.left = ids->size();
    answer.passes.assign(culler.passes().begin(), culler.passes().end());
    answer.cull_ms = watch.lap_ms();

    const auto first = static_cast<Index>(all.first_count);
    for (const auto& [a, b] : collision::find_crossings(all.triangles, all.positions, *ids)) {
        const bool same = (a < first) == (b < first);
        if (!(same ? options.within : options.between)) continue;
        ContactRow row;
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

} // namespace seldinger::engine
