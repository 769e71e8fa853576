#include "engine/step/solid/self_touch.hpp"

#include "base/closest_point.hpp"
#include "engine/effects/registry.hpp"
#include "engine/step/solid/touch_rules.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Cosine between a triangle's normal and the way from it to a vertex: beside a triangle its plane says nothing.
constexpr double kOver = 0.7;

/// Of the leaf's radius: what lay behind a triangle nearer than that at rest is the other side of the same flesh.
constexpr double kThickness = 4.0;

struct Own {
    const SceneModel& model;
    const State& state;
    SolidScratch& solids;
    std::size_t body;

    [[nodiscard]] const TriMesh& mesh() const { return model.bodies[body].surface; }
    [[nodiscard]] const std::vector<Vec3>& at() const { return state.bodies[body].surface; }
    [[nodiscard]] std::span<const Vec3> at_t0() const { return solids.bodies[body].surface_t0; }
};

bool is_other_side(const Own& own, Index v, const Triangle& t, double reach) {
    const std::vector<Vec3>& rest = own.mesh().vertices;
    const Vec3 normal = (rest[t[1]] - rest[t[0]]).cross(rest[t[2]] - rest[t[0]]);
    if (!(normal.dot(rest[v] - rest[t[0]]) < 0.0)) return false;
    return closest_on_triangle(rest[v], rest[t[0]], rest[t[1]], rest[t[2]]).distance_sq < reach * reach;
}

/// looking   unit, of the vertex
bool look_at(const Own& own, Index v, const Vec3& looking, Index triangle, double deepest) {
    const Triangle& t = own.mesh().triangles[triangle];
    if (t[0] == v || t[1] == v || t[2] == v) return false;
    const std::vector<Vec3>& at = own.at();
    const std::array<Vec3, 3> corners{at[t[0]], at[t[1]], at[t[2]]};
    const Vec3 normal = spheretree::direction_of((corners[1] - corners[0]).cross(corners[2] - corners[0]));
    if (!(looking.dot(normal) < kFacing)) return false;
    const auto hit = closest_on_triangle(at[v], corners[0], corners[1], corners[2]);
    const double distance = std::sqrt(hit.distance_sq);
    const double height = normal.dot(at[v] - hit.point);
    if (!(std::abs(height) >= kOver * distance)) return false;
    const bool behind = height < 0.0;
    if (behind && (distance > deepest || is_other_side(own, v, t, kThickness * deepest))) return false;
    const Vec3 before = hit.bary[0] * own.at_t0()[t[0]] + hit.bary[1] * own.at_t0()[t[1]] + hit.bary[2] * own.at_t0()[t[2]];
    const Vec3& mean = own.solids.bodies[own.body].motion.mean; // the body as a whole may go where it will
    const double way = (at[v] - own.at_t0()[v] - mean).norm() + (hit.point - before - mean).norm();
    if (!behind && distance > own.model.contact.margin + way) return false;
    SelfNear& near = own.solids.bodies[own.body].self_near[v];
    if (near.triangle == kNoIndex) own.solids.self_vertices.push_back(v);
    if (near.triangle != kNoIndex && !(distance < std::abs(near.gap))) return true;
    const Vec3 out = behind ? Vec3(hit.point - at[v]) : Vec3(at[v] - hit.point);
    near = {triangle, behind ? -distance : distance, hit.bary, distance > kNoWay ? Vec3(out / distance) : normal, hit.point};
    return true;
}

/// Vertices beneath one leaf against the triangles near them of leaves that lay apart from it at rest.
bool test_beneath(const Own& own, Index leaf) {
    SolidBodyScratch& scratch = own.solids.bodies[own.body];
    const spheretree::SphereTree& tree = own.model.bodies[own.body].covering.tree;
    const spheretree::Sphere& sphere = tree.spheres[leaf];
    bool touched = false;
    for (const Index mine : tree.items_of(leaf))
        for (const Index v : own.mesh().triangles[mine]) {
            if (scratch.vertex_seen[v] != 0) continue;
            scratch.vertex_seen[v] = 1;
            const Vec3 looking = normal_of_vertex(scratch.adjacency, own.mesh().triangles, v, own.at());
            Box3 box;
            box.add(own.at()[v]);
            box.inflate(sphere.radius + own.model.contact.margin + (own.at()[v] - own.at_t0()[v] - scratch.motion.mean).norm() +
                        scratch.motion.spread);
            scratch.inside.tree().for_each_overlapping(box, [&](Index triangle) {
                const spheretree::Sphere& other = tree.spheres[scratch.leaf_of_triangle[triangle]];
                const double apart = sphere.radius + other.radius + own.model.contact.margin;
                if ((sphere.centre - other.centre).squaredNorm() <= apart * apart) return;
                touched = look_at(own, v, looking, triangle, sphere.radius) || touched;
            });
        }
    return touched;
}

Contact make_touch(const Own& own, Index v) {
    const SelfNear& near = own.solids.bodies[own.body].self_near[v];
    const Triangle& t = own.mesh().triangles[near.triangle];
    Contact touch;
    touch.a = touch.b = Thing::body(own.body);
    touch.origin = ContactOrigin::Proximity;
    touch.point = near.point;
    touch.gap = near.gap;
    touch.normal = near.normal;
    touch.feature_a[0] = v;
    touch.bary_a[0] = 1.0;
    for (std::size_t k = 0; k < 3; ++k) touch.feature_b[k] = t[k], touch.bary_b[k] = near.bary[k];
    return touch;
}

} // namespace

void touch_self(const SceneModel& model, const State& state, std::span<LeafPair> pairs, SolidScratch& solids, StepReport& report) {
    report.effects.note(effects::self_contact);
    const Own own{model, state, solids, pairs.front().a};
    std::vector<SelfNear>& near = solids.bodies[own.body].self_near;
    near.resize(own.at().size());
    std::vector<Index>& found = solids.self_vertices;
    found.clear();
    SolidBodyScratch& scratch = solids.bodies[own.body];
    scratch.vertex_seen.assign(own.at().size(), 0);
    scratch.sphere_seen.assign(model.bodies[own.body].covering.tree.sphere_count(), 0);
    for (LeafPair& pair : pairs)
        for (const Index leaf : {pair.leaf_a, pair.leaf_b}) {
            if (scratch.sphere_seen[leaf] != 0) continue;
            scratch.sphere_seen[leaf] = 1;
            if (test_beneath(own, leaf)) pair.gap = 0.0;
        }
    std::sort(found.begin(), found.end());
    for (const Index v : found) {
        solids.touches.push_back(make_touch(own, v));
        near[v] = {};
    }
}

} // namespace trocar::engine
