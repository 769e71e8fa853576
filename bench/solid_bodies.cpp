#include "bench/solid_bodies.hpp"

#include "assets/anatomy/shapes.hpp"
#include "base/trig.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/time/clock.hpp"

#include <cmath>

namespace trocar::engine {

namespace {

constexpr unsigned kBranching = 8, kDepth = 3; // the paper's and the toolkit's

/// The medial tree where the surface has an inside, the shell's where it has no reliable one.
Result<SolidBody> make_body(std::string name, TriMesh mesh) {
    const bool sound = spheretree::check_surface_for(mesh, spheretree::Builder::Medial).ok();
    return make_solid_body(std::move(name), std::move(mesh), sound ? spheretree::Builder::Medial : spheretree::Builder::Shell);
}

Result<SolidBody> read_body(const BenchOptions& options, std::string name, const char* file) {
    options.progress(name);
    Result<TriMesh> mesh = read_surface(*options.data / file, {.weld = true});
    if (!mesh) return mesh.error();
    return make_body(std::move(name), std::move(*mesh));
}

TriMesh dented_ball(bool quick) {
    TriMesh ball = anatomy::make_icosphere(Vec3::Zero(), 0.08, quick ? 3 : 5);
    const Vec3 dent(0.0, 0.0, 0.09);
    for (Vec3& v : ball.vertices) v *= 1.0 - 0.5 * std::exp(-(v - dent).squaredNorm() / (0.05 * 0.05));
    return ball;
}

} // namespace

Result<SolidBody> make_solid_body(std::string name, TriMesh mesh, spheretree::Builder builder) {
    const std::int64_t start = monotonic_ns(), start_cpu = process_cpu_ns();
    Result<spheretree::WrappedTree> tree = spheretree::build_wrapped_tree(mesh, {builder, kBranching, kDepth});
    if (!tree) return tree.error();
    const double seconds = 1e-9 * static_cast<double>(monotonic_ns() - start);
    const double cpu = 1e-9 * static_cast<double>(process_cpu_ns() - start_cpu);
    return SolidBody{std::move(name), std::move(mesh), std::move(tree->tree), std::string(spheretree::builder_name(builder)), seconds, cpu};
}

PlacedBody place(const SolidBody& body, const Pose& pose) {
    const Vec3 middle = body.mesh.bounds().centre();
    const SinCos turn = sin_cos(pose.angle);
    const auto moved = [&](const Vec3& p) {
        const Vec3 q = p - middle;
        return Vec3(Vec3(turn.cos * q.x() + turn.sin * q.z(), q.y(), turn.cos * q.z() - turn.sin * q.x()) + pose.shift);
    };
    PlacedBody placed{body.mesh, body.tree.spheres};
    for (Vec3& v : placed.mesh.vertices) v = moved(v);
    for (spheretree::Sphere& s : placed.spheres) s.centre = moved(s.centre);
    return placed;
}

Result<std::vector<SolidBody>> make_dragon_and_bunny(const BenchOptions& options) {
    std::vector<SolidBody> bodies;
    const auto add = [&](Result<SolidBody> body) -> Result<void> {
        if (!body) return body.error();
        bodies.push_back(std::move(*body));
        return {};
    };
    Result<void> added;
    if (options.data) {
        if (added = add(read_body(options, "dragon", "stanford/dragon_vrip_res4.ply.gz")); !added) return added.error();
        if (added = add(read_body(options, "bunny", "stanford/bunny_7k_closed.off.gz")); !added) return added.error();
    } else {
        if (added =
                add(make_body("torus", anatomy::make_torus(Vec3::Zero(), 0.07, 0.03, options.quick ? 48 : 96, options.quick ? 18 : 36)));
            !added)
            return added.error();
        if (added = add(make_body("dented ball", dented_ball(options.quick))); !added) return added.error();
    }
    return bodies;
}

} // namespace trocar::engine
