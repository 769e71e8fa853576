#include "engine/step/solid/solid_passage.hpp"

#include "collision/ccd/sweep.hpp"
#include "engine/step/tissue/surface_place.hpp"
#include "engine/step/solid/touch_rules.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar::engine {

namespace {

/// Cosine. The nearest face and the one it came by look the same way: then nearest is as good, and smoother from step to step.
constexpr double kSameSide = 0.5;
/// Pieces of the way out that are looked at one after another, so that a slanting way does not look at all of a body.
constexpr int kPieces = 16;
/// Of a triangle's doubled area: a way out between two triangles must not slip through where they join.
constexpr double kJoin = 1e-9;

Vec3 unit_normal(const std::vector<Vec3>& surface, const Triangle& t) { return spheretree::direction_of(twice_area(t, surface)); }

/// Where the way from `place` along `out` leaves the other body first, through a face that looks that way; nothing: it is beside it.
std::optional<SurfacePoint> find_way_out(const OneWay& way, const Vec3& place, const Vec3& out) {
    const Box3 bounds = way.solids.bodies[way.other].inside.tree().bounds();
    const double length = 0.5 * bounds.extent().norm() + (0.5 * (bounds.lo + bounds.hi) - place).norm();
    return find_face_along(way, place, {out, 0.0, length, 1.0});
}

double cosine(const OneWay& way, Index triangle_a, Index triangle_b) {
    const std::vector<Vec3>& at = way.surface(way.other);
    return unit_normal(at, way.face(triangle_a)).dot(unit_normal(at, way.face(triangle_b)));
}

/// The first triangle that the vertex met in the step; kNoIndex: none.
Index find_first_crossing(const OneWay& way, Index vertex) {
    const SurfaceTravel& motion = way.solids.bodies[way.other].motion;
    const collision::SweptPoint path{way.surface_t0(way.own)[vertex], way.surface(way.own)[vertex]};
    const std::span<const Vec3> t0 = way.surface_t0(way.other), t1 = way.surface(way.other);
    Box3 box; // of the path, as the other body sees it
    box.add(path.t0 + motion.mean);
    box.add(path.t1);
    box.inflate(motion.spread * (1.0 + 0x1p-40) + kOnSurface);
    Index first = kNoIndex;
    double time = 2.0;
    way.solids.bodies[way.other].inside.tree().for_each_overlapping(box, [&](Index triangle) {
        const Triangle& t = way.face(triangle);
        const collision::Sweep met =
            collision::sweep_vertex_face(path, {{{t0[t[0]], t1[t[0]]}, {t0[t[1]], t1[t[1]]}, {t0[t[2]], t1[t[2]]}}}, {});
        if (!met.hit() || met.time > time || (met.time == time && triangle > first)) return;
        first = triangle;
        time = met.time;
    });
    return first;
}

/// Was it before this face when the step began? Then it came in by it.
bool was_before(const OneWay& way, Index vertex, const SurfacePoint& hit) {
    const std::span<const Vec3> t0 = way.surface_t0(way.other);
    const Triangle& t = way.face(hit.triangle);
    return twice_area(t, t0).dot(way.surface_t0(way.own)[vertex] - point_on(t, hit.bary, t0)) >= 0.0;
}

/// Does a vertex look at this face of the other? Sheets that meet look at each other.
bool looks_at(const OneWay& way, Index vertex, Index face) {
    return unit_normal(way.surface(way.other), way.face(face)).dot(way.looking(vertex)) < kFacing;
}

/// Round a corner from the side it came by another one is nearer: a table's vertex at the rim of a
/// block that rests on it goes on pressing on the block's lower side, though the upright one is nearer, and one that the block slides
/// over is not caught by its front.
bool stays_round_the_corner(const OneWay& way, Index vertex, Index by, Index nearest) {
    return looks_at(way, vertex, by) && !looks_at(way, vertex, nearest);
}

/// Behind the side by which it came, if it is: the body lies between it and where it came from.
/// deepest   m; of what lies outside, a longer way back through the body is another part's of it
std::optional<Standing> stand_behind(const OneWay& way, Index vertex, Index by, bool inside, const SurfacePoint& nearest, double deepest) {
    const double alike = cosine(way, nearest.triangle, by);
    if (!inside && alike > kFarSide && !looks_at(way, vertex, by) && looks_at(way, vertex, nearest.triangle)) return std::nullopt; // it cut a corner
    Standing standing;
    standing.inside = true;
    standing.by = nearest.triangle; // shallow: it slides along
    standing.at = nearest;
    if (inside && (alike > kSameSide || (alike > kFarSide && !stays_round_the_corner(way, vertex, by, nearest.triangle)))) return standing;
    const auto out = find_way_out(way, way.surface(way.own)[vertex], unit_normal(way.surface(way.other), way.face(by)));
    if (!out || (!inside && out->distance > deepest)) return std::nullopt;
    standing.by = by;
    standing.at = *out;
    standing.passed = !inside || alike < kFarSide;
    standing.pressed = standing.passed || out->distance > way.model.contact.margin;
    return standing;
}

/// The nearest place of the other surface. Vertices are asked for in turn, each beside the last: what was nearest to that one bounds the search.
std::optional<SurfacePoint> find_nearest(const OneWay& way, const Vec3& place, double within) {
    std::optional<Vec3>& last = way.solids.nearest;
    if (last) within = std::min(within, (place - *last).norm() + kOnSurface);
    const std::optional<SurfacePoint> nearest = way.solids.bodies[way.other].inside.tree().closest(place, within);
    if (nearest) last = nearest->point;
    return nearest;
}

} // namespace

std::optional<SurfacePoint> find_face_along(const OneWay& way, const Vec3& place, const Line& line) {
    const std::vector<Vec3>& at = way.surface(way.other);
    std::optional<SurfacePoint> first;
    const auto upto = [&](int piece) { return line.begin + (line.end - line.begin) * piece / kPieces; };
    const auto found = [&](int piece) { return first && (line.side > 0.0 || first->distance <= upto(piece)); };
    for (int k = 0; k < kPieces && !found(k); ++k) {
        Box3 piece;
        piece.add(place + upto(k) * line.direction);
        piece.add(place + upto(k + 1) * line.direction);
        way.solids.bodies[way.other].inside.tree().for_each_overlapping(piece, [&](Index triangle) {
            const Triangle& t = way.face(triangle);
            const Vec3 area = twice_area(t, at);
            const double along = area.dot(line.direction), size_sq = area.squaredNorm();
            if (!(line.side * along > 0.0)) return;
            const double distance = area.dot(at[t[0]] - place) / along;
            if (!(distance >= line.begin && distance <= line.end) || (first && !(distance < first->distance))) return;
            const Vec3 point = place + distance * line.direction;
            std::array<double, 3> bary;
            for (std::size_t c = 0; c < 3; ++c) {
                const Vec3 &from = at[t[(c + 1) % 3]], &to = at[t[(c + 2) % 3]];
                bary[c] = area.dot((to - from).cross(point - from)) / size_sq;
                if (bary[c] < -kJoin) return;
            }
            first = SurfacePoint{triangle, point, bary, distance};
        });
    }
    return first;
}

std::optional<Standing> find_standing(const OneWay& way, Index vertex, double reach) {
    const SolidBodyScratch& other = way.solids.bodies[way.other];
    const Vec3& place = way.surface(way.own)[vertex];
    const Vec3 moved = place - way.surface_t0(way.own)[vertex];
    const double way_of_both = std::min((moved - other.motion.mean).norm() + other.motion.spread, moved.norm() + other.motion.farthest);
    const SolidEntry* entry = find_entry(way.solids.entries_before, {way.own, way.other, vertex});
    const double look = std::max(reach, way_of_both);
    Box3 bounds = other.inside.tree().bounds();
    bounds.inflate(look);
    if (entry == nullptr && !bounds.contains(place)) return std::nullopt;
    const bool inside = other.inside.inside(place);
    const auto nearest = find_nearest(way, place, inside || entry != nullptr ? std::numeric_limits<double>::infinity() : look);
    if (!nearest) return std::nullopt;
    Standing as_seen;
    as_seen.inside = inside;
    as_seen.by = nearest->triangle;
    as_seen.at = *nearest;
    if (entry != nullptr) { // its path says nothing: it began on the wrong side
        const auto kept = stand_behind(way, vertex, entry->by, inside, *nearest, std::max(entry->depth, other.thickness) + way_of_both);
        return kept ? kept : as_seen;
    }
    if (inside ? was_before(way, vertex, *nearest) : nearest->distance > way_of_both) return as_seen;
    if (const Index met = find_first_crossing(way, vertex); met != kNoIndex)
        if (const auto came = stand_behind(way, vertex, met, inside, *nearest, way_of_both + way.model.contact.margin)) return came;
    return as_seen;
}

} // namespace trocar::engine
