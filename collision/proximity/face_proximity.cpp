#include "collision/proximity/face_proximity.hpp"

#include "base/closest_point.hpp"
#include "base/self_intersection.hpp"
#include "collision/ccd/ccd.hpp"
#include "collision/ccd/separation.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::collision {
namespace {

/// Weights of the point with parameter s on edge k.
std::array<double, 3> on_edge(std::size_t k, double s) noexcept {
    std::array<double, 3> bary{};
    bary[k] = 1.0 - s;
    bary[(k + 1) % 3] = s;
    return bary;
}
std::array<double, 3> on_corner(std::size_t k) noexcept {
    std::array<double, 3> bary{};
    bary[k] = 1.0;
    return bary;
}

/// The nearest so far of vertices against faces.
void take_vertices_of_a(const FaceCorners& a, const FaceCorners& b, double& best_sq, FacePoints& best, bool swapped) noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
        const PointOnTriangle on = closest_on_triangle(a[k], b[0], b[1], b[2]);
        if (!(on.distance_sq < best_sq)) continue;
        best_sq = on.distance_sq;
        best.bary_a = swapped ? on.bary : on_corner(k);
        best.bary_b = swapped ? on_corner(k) : on.bary;
    }
}

void take_edges(const FaceCorners& a, const FaceCorners& b, double& best_sq, FacePoints& best) noexcept {
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const PointsOnSegments on = closest_on_segments({a[i], a[(i + 1) % 3]}, {b[k], b[(k + 1) % 3]});
            if (!(on.distance_sq < best_sq)) continue;
            best_sq = on.distance_sq;
            best.bary_a = on_edge(i, on.s);
            best.bary_b = on_edge(k, on.t);
        }
}

/// Where an edge of a passes the plane of b, and lies nearest to b: of faces that cross, their common point up to rounding.
void take_passages(const FaceCorners& a, const FaceCorners& b, double& best_sq, FacePoints& best, bool swapped) noexcept {
    const Vec3 normal = (b[1] - b[0]).cross(b[2] - b[0]);
    for (std::size_t k = 0; k < 3; ++k) {
        const double from = normal.dot(a[k] - b[0]), to = normal.dot(a[(k + 1) % 3] - b[0]);
        if (!((from <= 0.0) != (to <= 0.0))) continue;
        const double s = from / (from - to);
        if (!(s >= 0.0 && s <= 1.0)) continue;
        const Vec3 at = (1.0 - s) * a[k] + s * a[(k + 1) % 3];
        const PointOnTriangle on = closest_on_triangle(at, b[0], b[1], b[2]);
        if (!(on.distance_sq < best_sq)) continue;
        best_sq = on.distance_sq;
        best.bary_a = swapped ? on.bary : on_edge(k, s);
        best.bary_b = swapped ? on_edge(k, s) : on.bary;
    }
}

Vec3 middle_of(const FaceCorners& f) noexcept { return (f[0] + f[1] + f[2]) / 3.0; }

/// All nine differences of corners: what lies between the faces is in their hull, so separation.hpp's proof holds.
Differences<9> differences_of(const SweptFace& a, const SweptFace& b, bool during_step) noexcept {
    Differences<9> q;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            q.t0[3 * i + k] = a.t0[i] - b.t0[k];
            q.t1[3 * i + k] = during_step ? Vec3(a.t1[i] - b.t1[k]) : q.t0[3 * i + k];
        }
    q.measure();
    return q;
}

/// Farther apart than the distance during the whole step, by one of a few directions? Pairs proven here need no more tests.
bool are_proven_apart(const SweptFace& a, const SweptFace& b, const Differences<9>& q, double distance) noexcept {
    const auto proves = [&](const Vec3& n) {
        const FreeTime free = find_free_time(q, n, distance);
        return free.from <= 0.0 && free.to >= 1.0;
    };
    if (proves(middle_of(a.t0) - middle_of(b.t0))) return true;
    for (const SweptFace* face : {&a, &b}) {
        const FaceCorners& f = face->t0;
        const Vec3 normal = (f[1] - f[0]).cross(f[2] - f[0]);
        if (proves(normal.dot(q.t0[4]) < 0.0 ? Vec3(-normal) : normal)) return true;
    }
    return false;
}

/// Most that a corner of one moves relative to a corner of the other, m.
double relative_motion(const Differences<9>& q) noexcept {
    double most = 0.0;
    for (std::size_t i = 0; i < 9; ++i) most = std::max(most, (q.t1[i] - q.t0[i]).squaredNorm());
    return std::sqrt(most);
}

SweptPoint corner(const SweptFace& f, std::size_t k) noexcept { return {f.t0[k], f.t1[k]}; }
std::array<SweptPoint, 2> edge(const SweptFace& f, std::size_t k) noexcept { return {corner(f, k), corner(f, (k + 1) % 3)}; }
std::array<SweptPoint, 3> corners(const SweptFace& f) noexcept { return {corner(f, 0), corner(f, 1), corner(f, 2)}; }

/// First contact of features after t0: what is kept of the earliest.
struct First {
    bool found = false;
    double time = 2.0, gap = 0.0;
    std::array<double, 3> bary_a{}, bary_b{};

    void take(double at, double distance, const std::array<double, 3>& a, const std::array<double, 3>& b) noexcept {
        found = true;
        if (at >= time) return;
        time = at;
        gap = distance;
        bary_a = a;
        bary_b = b;
    }
    [[nodiscard]] FaceProximity answer() const noexcept { return {{gap, bary_a, bary_b}, time}; }
};

void meet_vertices(const SweptFace& a, const SweptFace& b, double distance, bool swapped, First& first) {
    const SweepLimits limits{.distance = distance, .tolerance = kProximityTolerance * distance};
    for (std::size_t k = 0; k < 3; ++k) {
        const auto take = [&](double time, double gap, const std::array<double, 3>& bary) {
            first.take(time, gap, swapped ? bary : on_corner(k), swapped ? on_corner(k) : bary);
        };
        if (distance > 0.0) {
            const Sweep sweep = sweep_vertex_face(corner(a, k), corners(b), limits);
            if (sweep.hit()) take(sweep.time, sweep.gap, sweep.bary);
        } else {
            const CcdResult ccd = ccd_vertex_face(corner(a, k), corners(b));
            if (ccd.meets) take(ccd.time, 0.0, ccd.bary);
        }
    }
}

void meet_edges(const SweptFace& a, const SweptFace& b, double distance, First& first) {
    const SweepLimits limits{.distance = distance, .tolerance = kProximityTolerance * distance};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            if (distance > 0.0) {
                const Sweep sweep = sweep_edge_edge(edge(a, i), edge(b, k), limits);
                if (sweep.hit()) first.take(sweep.time, sweep.gap, on_edge(i, sweep.bary[0]), on_edge(k, sweep.bary[1]));
            } else {
                const CcdResult ccd = ccd_edge_edge(edge(a, i), edge(b, k));
                if (ccd.meets) first.take(ccd.time, 0.0, on_edge(i, ccd.bary[0]), on_edge(k, ccd.bary[1]));
            }
        }
}

/// No corner comes that near to another one from where they are? Rounding of a distance is a few u of the coordinates' size.
bool cannot_arrive(double now, double motion, double distance, double magnitude) noexcept {
    return now * (1.0 - 1e-12) - motion * (1.0 + 1e-12) - 1e-12 * magnitude > distance;
}

} // namespace

FacePoints closest_on_faces(const FaceCorners& a, const FaceCorners& b) noexcept {
    double best_sq = std::numeric_limits<double>::infinity();
    FacePoints best;
    take_vertices_of_a(a, b, best_sq, best, false);
    take_vertices_of_a(b, a, best_sq, best, true);
    take_edges(a, b, best_sq, best);
    best.distance = std::sqrt(best_sq);
    if (triangles_cross(a, b, Crossing::Touching)) {
        take_passages(a, b, best_sq, best, false);
        take_passages(b, a, best_sq, best, true);
        best.distance = 0.0;
    }
    return best;
}

bool find_face_proximity(const SweptFace& a, const SweptFace& b, double distance, bool during_step, FaceProximity& out) {
    const Differences<9> q = differences_of(a, b, during_step);
    if (are_proven_apart(a, b, q, distance)) return false;
    if (distance > 0.0 || triangles_cross(a.t0, b.t0, Crossing::Touching)) {
        out = {closest_on_faces(a.t0, b.t0), 0.0};
        if (out.points.distance <= distance) return true;
        if (!during_step || cannot_arrive(out.points.distance, relative_motion(q), distance, q.magnitude)) return false;
    }
    if (!during_step) return false;
    First first;
    meet_vertices(a, b, distance, false, first);
    meet_vertices(b, a, distance, true, first);
    meet_edges(a, b, distance, first);
    if (first.found) out = first.answer();
    return first.found;
}

bool find_vertex_proximity(const SweptFace& a, const SweptFace& b, double distance, bool during_step, bool both, FaceProximity& out) {
    const Differences<9> q = differences_of(a, b, during_step);
    if (are_proven_apart(a, b, q, distance)) return false;
    double best_sq = std::numeric_limits<double>::infinity();
    out = {};
    take_vertices_of_a(b.t0, a.t0, best_sq, out.points, true);
    if (both) take_vertices_of_a(a.t0, b.t0, best_sq, out.points, false);
    out.points.distance = std::sqrt(best_sq);
    if (out.points.distance <= distance) return true;
    if (!during_step) return false;
    First first;
    meet_vertices(b, a, distance, true, first);
    if (both) meet_vertices(a, b, distance, false, first);
    if (first.found) out = first.answer();
    return first.found;
}

} // namespace trocar::collision
