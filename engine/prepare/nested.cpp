#include "engine/prepare/nested.hpp"

#include "base/inside.hpp"
#include "base/self_intersection.hpp"
#include "engine/prepare/body_pairs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace trocar::engine {

namespace {

/// m; surfaces that are laid on one another do so to the digits of their files.
constexpr double kLaidOn = 1e-6;

struct Overlap {
    std::size_t vertices = 0;
    double depth = 0.0; // m
};

/// Adds the vertices of a surface that lie in another body.
void add_overlap(const std::vector<Vec3>& vertices, const Box3& where, const InsideTest& other, Overlap& overlap) {
    for (const Vec3& v : vertices) {
        if (!where.contains(v) || !other.inside(v)) continue;
        const auto way_out = other.tree().closest(v);
        if (!way_out || !(way_out->distance > kLaidOn)) continue;
        ++overlap.vertices;
        overlap.depth = std::max(overlap.depth, way_out->distance);
    }
}

/// Does an edge of one surface pass through the other one? What crosses need have no vertex inside.
bool do_cross(const BodyModel& own, const BodyModel& other, const TriangleTree& tree) {
    const std::vector<Vec3>&at = own.surface.vertices, &there = other.surface.vertices;
    return std::any_of(own.topology.edges.begin(), own.topology.edges.end(), [&](const collision::Edge& edge) {
        Box3 box;
        for (const Index v : edge) box.add(at[v]);
        bool found = false;
        tree.for_each_overlapping(box, [&](Index face) {
            const Triangle& t = other.surface.triangles[face];
            found = found || segment_pierces(at[edge[0]], at[edge[1]], {there[t[0]], there[t[1]], there[t[2]]});
        });
        return found;
    });
}

/// A note at the first of two solids that lie partly in one another.
void note_overlaps(const std::vector<Box3>& boxes, PreparedScene& prepared) {
    const std::vector<BodyModel>& bodies = prepared.model.bodies;
    std::vector<std::optional<InsideTest>> inside(bodies.size());
    const auto inside_of = [&](std::size_t i) -> const InsideTest& {
        if (!inside[i]) inside[i].emplace(bodies[i].surface);
        return *inside[i];
    };
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (std::size_t k = i + 1; k < bodies.size(); ++k) {
            if (!boxes[i].overlaps(boxes[k]) || owner_of(prepared.model, i) == owner_of(prepared.model, k)) continue;
            if (!are_solid_pair(prepared.model, i, k)) continue;
            Overlap overlap;
            if (bodies[k].closed) add_overlap(bodies[i].surface.vertices, boxes[k], inside_of(k), overlap);
            if (bodies[i].closed) add_overlap(bodies[k].surface.vertices, boxes[i], inside_of(i), overlap);
            const auto crosses = [&](std::size_t own, std::size_t other) { return bodies[other].closed && do_cross(bodies[own], bodies[other], inside_of(other).tree()); };
            if (overlap.vertices == 0 && !crosses(i, k) && !crosses(k, i)) continue;
            const std::string how = overlap.vertices > 0 ? fmt::format("by up to {:.3g} mm ({} vertices in the other)", 1e3 * overlap.depth, overlap.vertices)
                                                         : "(edges cross, with no vertex in the other)";
            prepared.bodies[i].notes.push_back(
                fmt::format("overlaps {} at the start {}: contact parts the two slowly, which is no load of theirs", bodies[k].name, how));
        }
}

} // namespace

void find_nested(PreparedScene& prepared) {
    const std::vector<BodyModel>& bodies = prepared.model.bodies;
    std::vector<Box3> boxes(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (const Vec3& v : bodies[i].surface.vertices) boxes[i].add(v);
    const auto lies_in = [&](std::size_t i, std::size_t k) {
        const BodyModel &inner = bodies[i], &outer = bodies[k];
        if (i == k || inner.hollow || outer.hollow || !outer.closed || (!inner.moves() && !outer.moves())) return false;
        if (inner.host_body == k || outer.host_body == i || inner.surface.vertices.empty()) return false;
        if (!boxes[k].contains(boxes[i].lo) || !boxes[k].contains(boxes[i].hi)) return false;
        const InsideTest inside(outer.surface);
        return std::all_of(inner.surface.vertices.begin(), inner.surface.vertices.end(), [&](const Vec3& v) { return inside.inside(v); });
    };
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (std::size_t k = 0; k < bodies.size(); ++k) {
            if (!lies_in(i, k)) continue;
            prepared.model.nested.emplace_back(std::min(i, k), std::max(i, k));
            prepared.bodies[i].notes.push_back(fmt::format("starts wholly inside {}: the two do not touch one another", bodies[k].name));
        }
    std::sort(prepared.model.nested.begin(), prepared.model.nested.end());
    if (prepared.model.effects.coarse_contact) note_overlaps(boxes, prepared);
}

} // namespace trocar::engine
