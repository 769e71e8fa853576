#include "engine/step/solid/carry_touch.hpp"

#include "engine/step/solid/touch_rules.hpp"
#include "engine/step/tissue/surface_place.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Triangles that a place may slide over in a step.
constexpr int kMostWalked = 16;

SurfacePoint near_on(const OneWay& way, Index triangle, const Vec3& place) {
    const std::vector<Vec3>& at = way.surface(way.other);
    const Triangle& t = way.face(triangle);
    const PointOnTriangle found = closest_on_triangle(place, at[t[0]], at[t[1]], at[t[2]]);
    return {triangle, found.point, found.bary, (place - found.point).norm()};
}

/// The triangle of these corners; kNoIndex: there is none.
Index find_face(const SurfaceAdjacency& adjacency, const std::vector<Triangle>& triangles, const Index (&corners)[3]) {
    for (Index k = adjacency.vertex_begin[corners[0]]; k < adjacency.vertex_begin[corners[0] + 1]; ++k) {
        const Triangle& t = triangles[adjacency.vertex_face[k]];
        const auto has = [&](Index v) { return t[0] == v || t[1] == v || t[2] == v; };
        if (has(corners[1]) && has(corners[2])) return adjacency.vertex_face[k];
    }
    return kNoIndex;
}

/// Downhill over the surface, from neighbour to neighbour.
SurfacePoint walk(const OneWay& way, const SurfaceAdjacency& adjacency, Index start, const Vec3& place) {
    SurfacePoint best = near_on(way, start, place);
    for (int step = 0; step < kMostWalked; ++step) {
        const Index from = best.triangle;
        for (const Index v : way.face(from))
            for (Index k = adjacency.vertex_begin[v]; k < adjacency.vertex_begin[v + 1]; ++k) {
                const SurfacePoint next = near_on(way, adjacency.vertex_face[k], place);
                if (next.distance < best.distance) best = next;
            }
        if (best.triangle == from) break;
    }
    return best;
}

} // namespace

std::optional<Contact> carry_touch(const OneWay& way, const Contact& touch) {
    const SurfaceAdjacency& adjacency = way.solids.bodies[way.other].adjacency;
    const std::vector<Triangle>& triangles = way.model.bodies[way.other].surface.triangles;
    const std::vector<Vec3>& own = way.surface(way.own);
    Vec3 place = touch.bary_a[0] * own[touch.feature_a[0]];
    if (touch.feature_a[1] != kNoIndex) place += touch.bary_a[1] * own[touch.feature_a[1]];
    Contact now = touch;
    const Index start = adjacency.vertex_begin.empty() || touch.between_edges() ? kNoIndex : find_face(adjacency, triangles, touch.feature_b);
    const double margin = way.model.contact.margin;
    if (way.own == way.other || start == kNoIndex || touch.gap < -margin) {
        const std::vector<Vec3>& there = way.surface(way.other);
        now.point.setZero();
        for (std::size_t k = 0; k < (touch.between_edges() ? 2u : 3u); ++k) now.point += touch.bary_b[k] * there[touch.feature_b[k]];
        now.gap = now.normal.dot(place - now.point);
    } else {
        const SurfacePoint at = walk(way, adjacency, start, place);
        const Triangle& face = way.face(at.triangle);
        // on a face the face says where out is; round a corner the direction that it had
        if (at.bary[0] > 0.0 && at.bary[1] > 0.0 && at.bary[2] > 0.0)
            now.normal = spheretree::direction_of(twice_area(face, way.surface(way.other)));
        now.point = at.point;
        now.gap = now.normal.dot(place - at.point);
        for (std::size_t k = 0; k < 3; ++k) now.feature_b[k] = face[k], now.bary_b[k] = at.bary[k];
    }
    const bool pressed = !touch.force.isZero(0.0);
    if (now.gap > std::max(margin, pressed ? 0.0 : touch.gap)) return std::nullopt;
    return now;
}

} // namespace trocar::engine
