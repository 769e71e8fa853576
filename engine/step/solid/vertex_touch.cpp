#include "engine/step/solid/vertex_touch.hpp"

#include "engine/step/solid/touch_rules.hpp"
#include "engine/step/tissue/surface_place.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Cosine of half the cone of normals around a vertex, below which it goes ahead of the faces around it: those of a box's edges have 0.71.
constexpr double kSharpVertex = 0.77;
/// Cosine; two planes that are nearly one.
constexpr double kSamePlane = 0.94;
/// Cosine of the way to the nearest place and the face there, beyond which that is no place of an edge.
constexpr double kOnFace = 0.999;
/// Of a path and the surface it passes: three bring the two within a few hundredths of their distance, where the surface is convex.
constexpr int kPassingRounds = 3;

Vec3 face_normal(const std::vector<Vec3>& surface, const Triangle& t) { return spheretree::direction_of(twice_area(t, surface)); }

/// The touch of a place with what of the other surface it stands before, or behind.
Contact make_touch(const OneWay& way, const VertexProbe& probe, const Vec3& place, const SurfacePoint& at, bool inside) {
    const Triangle& face = way.face(at.triangle);
    Contact touch;
    touch.a = Thing::body(way.own);
    touch.b = Thing::body(way.other);
    touch.origin = ContactOrigin::Proximity;
    touch.point = at.point;
    touch.gap = inside ? -at.distance : at.distance;
    const Vec3 out = inside ? Vec3(at.point - place) : Vec3(place - at.point);
    touch.normal = at.distance > kNoWay ? Vec3(out / at.distance) : face_normal(way.surface(way.other), face);
    for (int k = 0; k < 2; ++k) touch.feature_a[k] = probe.vertex[k], touch.bary_a[k] = probe.weight[k];
    for (std::size_t k = 0; k < 3; ++k) touch.feature_b[k] = face[k], touch.bary_b[k] = at.bary[k];
    return touch;
}

/// Gives the touch the normal by which the two surfaces push there. False: they do not.
bool turn_touch(const OneWay& way, const NormalCone& own, const SurfacePoint& at, const Vec3& place, Contact& touch) {
    const double facet = facet_cosine(way.solids.bodies[way.other].adjacency, way.model.bodies[way.other].topology, at.triangle,
                                      way.surface(way.other));
    const std::optional<Vec3> normal = choose_normal(own, touch.normal, facet);
    if (!normal) return false;
    if (*normal == touch.normal) return true;
    touch.normal = *normal;
    touch.gap = normal->dot(place - at.point);
    return true;
}

NormalCone cone_at(const OneWay& way, Index v) {
    return cone_of_vertex(way.solids.bodies[way.own].adjacency, way.model.bodies[way.own].surface.triangles, v, way.surface(way.own));
}

/// turn_touch of what is outside, which also lies on the side that the vertex looks to: a sharp corner does so far from its mean normal.
bool turn_to_meet(const OneWay& way, Index v, const NormalCone& own, const SurfacePoint& at, const Vec3& place, Contact& touch) {
    const bool looks_at = -touch.normal.dot(own.axis) >= own.cosine;
    return turn_touch(way, own, at, place, touch) && (looks_at || !(touch.normal.dot(way.looking(v)) > kFacing));
}

/// m; the way of a vertex in the next step against a place of the other surface, if both go on as in this one.
Vec3 find_path(const OneWay& way, Index v, const Vec3& place, const SurfacePoint& there) {
    const Triangle& t = way.face(there.triangle);
    const Vec3 moved = point_on(t, there.bary, way.surface(way.other)) - point_on(t, there.bary, way.surface_t0(way.other));
    return place - way.surface_t0(way.own)[v] - moved + way.solids.bodies[way.own].change - way.solids.bodies[way.other].change;
}

/// The touch of a vertex with the face by which its path goes in; or, if it does not look at that, round its corner with the one that it looks at, if that is the nearest where its
/// path ends but for what it falls: a table's rim, over which the front of a block slides, goes in by that front only as the block is expected to sink.
Contact make_coming_touch(const OneWay& way, Index v, const Vec3& place, const Vec3& path, SurfacePoint in) {
    const std::vector<Vec3>& there = way.surface(way.other);
    Vec3 normal = face_normal(there, way.face(in.triangle));
    const Vec3 fall = way.solids.bodies[way.own].fall - way.solids.bodies[way.other].fall;
    if (const auto end = way.solids.bodies[way.other].inside.tree().closest(place + path - fall)) {
        const Vec3 at_end = face_normal(there, way.face(end->triangle));
        const Vec3 own = way.looking(v);
        if (!(normal.dot(own) < kFacing) && at_end.dot(own) < kFacing && at_end.dot(normal) > kFarSide) in = *end, normal = at_end;
    }
    in.distance = normal.dot(place - in.point); // of the face's plane, where it was along the path
    Contact touch = make_touch(way, {{v, kNoIndex}, {1.0, 0.0}}, place, in, false);
    touch.normal = normal;
    return touch;
}

/// The plane between the path of a vertex that passes by and the place of the other surface that it comes nearest to: it holds the vertex only where it
/// leaves its path, as what strikes something else in the step does.
std::optional<Contact> find_passing_touch(const OneWay& way, Index v, const Vec3& place, const Vec3& path, const SurfacePoint& nearest, const NormalCone& cone) {
    SurfacePoint at = nearest;
    Vec3 passing = place;
    for (int round = 0; round < kPassingRounds; ++round) { // to and fro between the path and the surface
        passing = place + std::clamp(path.dot(at.point - place) / path.squaredNorm(), 0.0, 1.0) * path;
        const auto hit = way.solids.bodies[way.other].inside.tree().closest(passing);
        if (!hit) return std::nullopt;
        at = *hit;
    }
    if (!(at.distance > kNoWay)) return std::nullopt;
    Contact touch = make_touch(way, {{v, kNoIndex}, {1.0, 0.0}}, passing, at, false);
    if (!turn_to_meet(way, v, cone, at, passing, touch)) return std::nullopt;
    touch.gap = touch.normal.dot(place - at.point);
    return touch.gap > 0.0 && touch.gap + touch.normal.dot(path) >= 0.0 ? std::optional(touch) : std::nullopt;
}

/// How a vertex that is outside is kept out in the next step: by the plane at what is nearest to it, unless that holds it as it goes; else at the face by
/// which its path goes in, or between the two where it passes by. The plane at an edge reaches into free space, and what flies past it there is held by nothing.
/// meets   nearest is what it would push
std::optional<Contact> choose_touch(const OneWay& way, Index v, const Vec3& place, const SurfacePoint& at, const NormalCone& cone, const Contact& nearest,
                                    bool meets) {
    const bool on_face = !(face_normal(way.surface(way.other), way.face(at.triangle)).dot(place - at.point) < kOnFace * at.distance - kNoWay);
    if (meets && on_face && nearest.gap <= way.model.contact.margin) return nearest;
    if (!meets && !(cone.cosine < kSharpVertex)) return std::nullopt; // flat, and it lies beside
    const Vec3 path = find_path(way, v, place, at);
    if (meets && nearest.gap + nearest.normal.dot(path) >= 0.0) return nearest; // the plane does not hold it as it goes
    const double length = path.norm();
    if (!(length > at.distance)) return meets ? std::optional(nearest) : std::nullopt;
    const auto in = find_face_along(way, place, {path / length, at.distance - kOnSurface, length, -1.0});
    if (!in) return meets ? find_passing_touch(way, v, place, path, at, cone) : std::nullopt;
    const Contact coming = make_coming_touch(way, v, place, path, *in);
    return meets && coming.normal.dot(nearest.normal) > kSamePlane ? nearest : coming;
}

} // namespace

Look test_vertex(const OneWay& way, Index v, double reach) {
    const Vec3 place = way.surface(way.own)[v];
    const double own_way = (place - way.surface_t0(way.own)[v] - way.shared()).norm();
    const auto standing = find_standing(way, v, reach + own_way);
    if (!standing) return {};
    Contact touch = make_touch(way, {{v, kNoIndex}, {1.0, 0.0}}, place, standing->at, standing->inside);
    SolidScratch& solids = way.solids;
    const NormalCone cone = cone_at(way, v);
    const bool meets = standing->inside ? standing->pressed || turn_touch(way, cone, standing->at, place, touch)
                                        : turn_to_meet(way, v, cone, standing->at, place, touch);
    if (!standing->inside) {
        const Triangle& face = way.face(standing->at.triangle);
        const Vec3 now = point_on(face, standing->at.bary, way.surface(way.other));
        const Vec3 before = point_on(face, standing->at.bary, way.surface_t0(way.other));
        const bool is_far = touch.gap > way.model.contact.margin + own_way + (now - before - way.shared()).norm() + way.known_change();
        const std::optional<Contact> chosen = choose_touch(way, v, place, standing->at, cone, touch, meets && !is_far);
        if (!chosen) return {};
        solids.touches.push_back(*chosen);
        return {kNear, chosen->gap};
    }
    if (standing->pressed) solids.pressed.push_back(solids.touches.size());
    way.report.passed_places += standing->passed;
    way.entries.push_back({way.own, way.other, v, standing->by, standing->at.distance});
    if (meets) solids.touches.push_back(touch);
    return {kInside, touch.gap};
}

void add_edge_touch(const OneWay& way, const VertexProbe& probe) {
    const InsideTest& against = way.solids.bodies[way.other].inside;
    const Vec3 place = probe.at(way.surface(way.own));
    if (!against.inside(place)) return;
    const auto hit = against.tree().closest(place);
    if (!hit) return;
    Contact touch = make_touch(way, probe, place, *hit, true);
    const BodyModel& own = way.model.bodies[way.own];
    const NormalCone cone = cone_of_edge(way.solids.bodies[way.own].adjacency, own.topology, probe.vertex[0], probe.vertex[1], way.surface(way.own));
    if (turn_touch(way, cone, *hit, place, touch)) way.solids.touches.push_back(touch);
}

} // namespace trocar::engine
