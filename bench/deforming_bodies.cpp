#include "bench/deforming_bodies.hpp"

#include "base/trig.hpp"
#include "engine/time/clock.hpp"
#include "fem/mesh/lattice.hpp"
#include "fem/embedding/links.hpp"
#include "spheretree/update/deforming_tree.hpp"
#include "spheretree/traverse/descent.hpp"
#include "spheretree/build/tree_quality.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

using spheretree::SphereUpdate;

constexpr std::size_t kNodes = 1500; // of the coarse mesh
constexpr double kRightAngle = 1.5707963267948966;

/// Coordinates relative to the body's middle, as shares of its longest edge.
using Deform = Vec3 (*)(const Vec3&);
struct DeformedCase {
    const char* name;
    Deform by;
};
Vec3 stay(const Vec3& p) { return p; }
Vec3 turn(const Vec3& p) { return rotation_about(Vec3::UnitX(), kRightAngle) * p; }
Vec3 bend(const Vec3& p) { // by a right angle over its length
    const double radius = 1.0 / kRightAngle;
    const SinCos arc = sin_cos(p.y() / radius);
    return {(radius + p.x()) * arc.cos - radius, (radius + p.x()) * arc.sin, p.z()};
}
Vec3 stretch(const Vec3& p) { return {p.x() / std::sqrt(1.3), 1.3 * p.y(), p.z() / std::sqrt(1.3)}; }
Vec3 twist(const Vec3& p) { return rotation_about(Vec3::UnitY(), kRightAngle * p.y()) * p; }
constexpr DeformedCase kDeformations[] = {{"at rest", stay},
                           {"turned by 90 degrees", turn},
                           {"bent by 90 degrees", bend},
                           {"stretched by 1.3", stretch},
                           {"twisted by 90 degrees", twist}};

struct Linked {
    fem::RigidLinks links;
    spheretree::DeformingTree tree;
};

Result<Linked> link_body(const SolidBody& body) {
    const Result<fem::LatticeMesh> lattice = fem::make_lattice_of_nodes(body.mesh, kNodes);
    if (!lattice) return lattice.error();
    Result<fem::RigidLinks> links = fem::make_surface_links(lattice->tets, body.mesh);
    if (!links) return links.error();
    spheretree::DeformingTree tree = spheretree::make_deforming_tree(
        body.tree, body.mesh,
        {links->frame_nodes, links->frame_rest, links->vertex_frame, links->vertex_projection, links->vertex_blend, links->node_rest,
         links->affine_nodes, links->affine_weight});
    return Linked{std::move(*links), std::move(tree)};
}

struct Posed {
    std::vector<Vec3> nodes;
    std::vector<Mat3> turn;
    TriMesh mesh;
    [[nodiscard]] spheretree::NodePose pose() const { return {nodes, turn}; }
};

Posed pose_body(const SolidBody& body, const Linked& linked, Deform by, const Vec3& shift) {
    const Vec3 middle = body.mesh.bounds().centre();
    const double size = body.mesh.bounds().longest_edge();
    Posed posed;
    for (const Vec3& q : linked.links.node_rest) posed.nodes.push_back(size * by((q - middle) / size) + middle + shift);
    posed.mesh = body.mesh;
    fem::LinkFrames frames;
    (void)fem::update_embedded_surface(linked.links, posed.nodes, body.mesh.vertices, frames, posed.mesh.vertices);
    for (const fem::LinkFrame& frame : frames.frame) {
        posed.turn.emplace_back();
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row) posed.turn.back()(row, column) = frame.turn[column][row];
    }
    return posed;
}

/// m; how far the farthest vertex lies outside all leaves.
double farthest_escape(const TriMesh& mesh, std::span<const spheretree::Sphere> leaves) {
    double escape = 0.0;
    for (const Vec3& p : mesh.vertices) {
        double least = std::numeric_limits<double>::infinity();
        for (const spheretree::Sphere& s : leaves) least = std::min(least, (p - s.centre).norm() - s.radius);
        escape = std::max(escape, least);
    }
    return escape;
}

BenchRow judge(const SolidBody& body, const Linked& linked, const DeformedCase& tested, SphereUpdate update) {
    constexpr int kRepeats = 20;
    const Posed posed = pose_body(body, linked, tested.by, Vec3::Zero());
    spheretree::SphereTree now = body.tree;
    const std::int64_t start = thread_cpu_ns();
    for (int k = 0; k < kRepeats; ++k)
        for (Index s = 0; s < now.sphere_count(); ++s) now.spheres[s] = spheretree::deform_sphere(linked.tree, s, posed.pose(), update);
    const std::int64_t ns = thread_cpu_ns() - start;
    const spheretree::TreeQuality quality = spheretree::measure_quality(now, posed.mesh, false, {1e-4, 8, 8});
    double uncovered = 0.0, growth = 0.0;
    for (const auto& level : quality.levels) uncovered = std::max(uncovered, level.uncovered);
    const Index first = now.level_begin[now.level_count() - 1];
    for (Index s = first; s < now.sphere_count(); ++s) growth += now.spheres[s].radius / body.tree.spheres[s].radius;
    return {
        {"mesh", body.name},
        {"builder", update == SphereUpdate::Conservative ? "conservative" : "the paper's"},
        {"deformation", tested.name},
        {"uncovered_percent", 100.0 * uncovered},
        {"reachable_percent", 100.0 * quality.levels.back().reachable},
        {"escape_permille", 1e3 * farthest_escape(posed.mesh, std::span(now.spheres).subspan(first)) / body.mesh.bounds().longest_edge()},
        {"leaf_growth", growth / static_cast<double>(now.sphere_count() - first)},
        {"update_ns_per_sphere", static_cast<double>(ns) / (kRepeats * static_cast<double>(now.sphere_count()))}};
}

/// Two bent bodies side by side; spheres are evaluated lazily by the descent.
BenchRow measure_lazy(const SolidBody& body, const Linked& linked, SphereUpdate update, std::uint64_t work) {
    constexpr int kRounds = 40;
    const Posed here = pose_body(body, linked, bend, Vec3::Zero());
    const Posed beside = pose_body(body, linked, twist, Vec3(0.45 * body.mesh.bounds().extent().x(), 0.0, 0.0));
    spheretree::DeformingSpheres a, b;
    spheretree::Descent descent;
    std::uint64_t tests = 0, updated = 0;
    const std::int64_t start = thread_cpu_ns();
    for (int k = 0; k < kRounds; ++k) {
        a.begin(linked.tree, update, here.pose());
        b.begin(linked.tree, update, beside.pose());
        descent.begin(0.0);
        descent.add_solid_pair({Thing::body(0), &linked.tree.tree, a.spheres(), &a}, {Thing::body(1), &linked.tree.tree, b.spheres(), &b});
        WorkBudget budget(work);
        descent.run(budget);
        tests += descent.stats().pairs_tested;
        updated += a.updated() + b.updated();
    }
    const auto ns = static_cast<double>(thread_cpu_ns() - start);
    return {{"mesh", "two of " + body.name},
            {"builder", update == SphereUpdate::Conservative ? "conservative" : "the paper's"},
            {"deformation", work == WorkBudget::kUnlimited ? "bent and twisted" : "the same, 1000 tests"},
            {"pair_tests", tests / kRounds},
            {"million_tests_per_s", 1e3 * static_cast<double>(tests) / ns},
            {"spheres_updated", updated / kRounds},
            {"us", 1e-3 * ns / kRounds}};
}

} // namespace

Result<void> add_updates(const SolidBody& body, BenchTable& table) {
    const Result<Linked> linked = link_body(body);
    if (!linked) return linked.error();
    for (const DeformedCase& tested : kDeformations)
        for (const SphereUpdate update : {SphereUpdate::Conservative, SphereUpdate::Heuristic})
            table.rows.push_back(judge(body, *linked, tested, update));
    for (const SphereUpdate update : {SphereUpdate::Conservative, SphereUpdate::Heuristic})
        for (const std::uint64_t work : {std::uint64_t{1000}, WorkBudget::kUnlimited})
            table.rows.push_back(measure_lazy(body, *linked, update, work));
    return {};
}

} // namespace trocar::engine
