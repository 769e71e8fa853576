#include "collision/bvh/contour.hpp"

#include "collision/ccd/sweep.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::collision {
namespace {

using Directed = std::array<Index, 2>;

/// Edges of the faces that no other of them runs through the other way, by their first vertex.
bool border_of(std::span<const Triangle> triangles, std::span<const Index> faces, std::vector<Directed>& border) {
    std::vector<Directed> all;
    all.reserve(3 * faces.size());
    for (const Index id : faces) {
        const Triangle& t = triangles[id];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
        for (std::size_t k = 0; k < 3; ++k) all.push_back({t[k], t[(k + 1) % 3]});
    }
    std::sort(all.begin(), all.end());
    if (std::adjacent_find(all.begin(), all.end()) != all.end()) return false;
    for (const Directed& e : all)
        if (!std::binary_search(all.begin(), all.end(), Directed{e[1], e[0]})) border.push_back(e);
    return true;
}

/// Errors of places and of what is computed from them, per size (squared): a subtraction, three products with a unit vector and two
/// sums for a place, 10 u at most; a product of two differences of places 2 (2 * 10 + 3) u, a sum of two of them and of the bounds of
/// Bernstein's middle coefficient less than 200 u. 1e-13 is 900 u.
constexpr double kPlaneError = 1e-13;

} // namespace

bool make_contour(std::span<const Triangle> triangles, std::span<const Index> faces, Contour& out) {
    std::vector<Directed> border;
    return border_of(triangles, faces, border) && make_contour(border, out);
}

bool make_contour(std::vector<Directed>& border, Contour& out) {
    out.vertices.clear();
    out.loop_ends.clear();
    if (border.empty() || border.size() > kLongestContour) return false;
    std::sort(border.begin(), border.end());
    for (std::size_t i = 1; i < border.size(); ++i)
        if (border[i][0] == border[i - 1][0]) return false;
    std::vector<bool> used(border.size(), false);
    for (std::size_t first = 0; first < border.size(); ++first) {
        for (std::size_t at = first; !used[at];) {
            used[at] = true;
            out.vertices.push_back(border[at][0]);
            const auto next = std::lower_bound(border.begin(), border.end(), Directed{border[at][1], 0});
            if (next == border.end() || (*next)[0] != border[at][1]) return false;
            at = static_cast<std::size_t>(next - border.begin());
        }
        if (out.loop_ends.empty() || out.loop_ends.back() != out.vertices.size())
            out.loop_ends.push_back(static_cast<Index>(out.vertices.size()));
    }
    return true;
}

void ContourTest::project(const ContourView& contour, const SurfaceMotion& motion, const Vec3& direction) {
    int smallest = 0;
    direction.cwiseAbs().minCoeff(&smallest);
    const Vec3 right = direction.cross(Vec3(Vec3::Unit(smallest))).normalized(), up = direction.cross(right);
    const Vec3 origin = motion.t0[contour.vertices[0]];
    places_.clear();
    size_ = 0.0;
    for (const Index v : contour.vertices) {
        const Vec3 p0 = motion.t0[v] - origin, p1 = motion.t1[v] - origin;
        places_.push_back({right.dot(p0), up.dot(p0), right.dot(p1), up.dot(p1)});
        size_ = std::max({size_, p0.lpNorm<1>(), p1.lpNorm<1>()});
    }
}

void ContourTest::make_sides(const ContourView& contour) {
    sides_.clear();
    Index begin = 0;
    for (Index loop = 0; loop < contour.loop_ends.size(); ++loop) {
        const Index end = contour.loop_ends[loop];
        for (Index i = begin; i < end; ++i) {
            const Index next = i + 1 == end ? begin : i + 1;
            const Place &a = places_[i], &b = places_[next];
            sides_.push_back({std::min({a.x0, a.x1, b.x0, b.x1}), std::max({a.x0, a.x1, b.x0, b.x1}), std::min({a.y0, a.y1, b.y0, b.y1}),
                              std::max({a.y0, a.y1, b.y0, b.y1}), i, next, loop});
        }
        begin = end;
    }
}

/// Two consecutive sides meet at their common end alone, at all times: the turn keeps its sign, or is never a sharp one. Both are
/// quadratic in time; Bernstein coefficients bound them.
bool ContourTest::turns_clear(const ContourView& contour) const noexcept {
    const double bound = kPlaneError * size_ * size_;
    Index begin = 0;
    for (const Index end : contour.loop_ends) {
        for (Index i = begin; i < end; ++i) {
            const Place &a = places_[i == begin ? end - 1 : i - 1], &b = places_[i], &c = places_[i + 1 == end ? begin : i + 1];
            const double px0 = a.x0 - b.x0, py0 = a.y0 - b.y0, px1 = a.x1 - b.x1, py1 = a.y1 - b.y1;
            const double qx0 = c.x0 - b.x0, qy0 = c.y0 - b.y0, qx1 = c.x1 - b.x1, qy1 = c.y1 - b.y1;
            const double cross[] = {px0 * qy0 - py0 * qx0, 0.5 * (px0 * qy1 - py0 * qx1 + px1 * qy0 - py1 * qx0), px1 * qy1 - py1 * qx1};
            const double dot[] = {px0 * qx0 + py0 * qy0, 0.5 * (px0 * qx1 + py0 * qy1 + px1 * qx0 + py1 * qy0), px1 * qx1 + py1 * qy1};
            const auto all_above = [&](const double* c3, double sign) {
                return sign * c3[0] > bound && sign * c3[1] > bound && sign * c3[2] > bound;
            };
            if (!all_above(cross, 1.0) && !all_above(cross, -1.0) && !all_above(dot, -1.0)) return false;
        }
        begin = end;
    }
    return true;
}

/// Sides that share no end, by sweeping over x; boxes first, then a proof by sweep.hpp in the plane.
bool ContourTest::sides_stay_apart() {
    std::sort(sides_.begin(), sides_.end(),
              [](const Side& a, const Side& b) { return a.x_lo != b.x_lo ? a.x_lo < b.x_lo : a.from < b.from; });
    const double error = kPlaneError * size_;
    const auto swept = [&](Index place) {
        const Place& p = places_[place];
        return SweptPoint{Vec3(p.x0, p.y0, 0.0), Vec3(p.x1, p.y1, 0.0)};
    };
    for (std::size_t i = 0; i < sides_.size(); ++i) {
        const Side& a = sides_[i];
        for (std::size_t k = i + 1; k < sides_.size() && sides_[k].x_lo <= a.x_hi + error; ++k) {
            const Side& b = sides_[k];
            if (b.y_lo > a.y_hi + error || b.y_hi < a.y_lo - error) continue;
            if (a.from == b.to || a.to == b.from) continue;
            const SweepLimits limits{.distance = error, .tolerance = error, .max_steps = 32};
            if (sweep_edge_edge({swept(a.from), swept(a.to)}, {swept(b.from), swept(b.to)}, limits).hit()) return false;
        }
    }
    return true;
}

bool ContourTest::winding_of_others(Index place, Index loop, int& winding) const noexcept {
    const double bound = kPlaneError * size_ * size_, error = kPlaneError * size_;
    const Place& p = places_[place];
    winding = 0;
    for (const Side& side : sides_) {
        if (side.loop == loop) continue;
        const Place &a = places_[side.from], &b = places_[side.to];
        if (std::abs(a.y0 - p.y0) <= error || std::abs(b.y0 - p.y0) <= error) return false;
        if ((a.y0 > p.y0) == (b.y0 > p.y0)) continue;
        const double turn = (b.x0 - a.x0) * (p.y0 - a.y0) - (b.y0 - a.y0) * (p.x0 - a.x0); // > 0: p is left of the side
        if (std::abs(turn) <= bound) return false;
        if (b.y0 > a.y0 && turn > 0.0) ++winding;
        if (b.y0 < a.y0 && turn < 0.0) --winding;
    }
    return true;
}

/// Just inside a loop that runs counter-clockwise the border winds once more than outside it, inside one that runs clockwise once
/// less; between loops that do not meet it does not change. So it is enough to test each loop: 0 outside the former, 1 outside the
/// latter. One time is enough as well, since nothing meets later.
bool ContourTest::winding_is_simple(const ContourView& contour) const noexcept {
    if (contour.loop_ends.size() == 1) return true; // around its inside, and not -1 times, since faces lie there
    Index begin = 0;
    for (Index loop = 0; loop < contour.loop_ends.size(); ++loop) {
        const Index end = contour.loop_ends[loop];
        double area = 0.0;
        for (Index i = begin; i < end; ++i) {
            const Place &a = places_[i], &b = places_[i + 1 == end ? begin : i + 1], &o = places_[begin];
            area += (a.x0 - o.x0) * (b.y0 - o.y0) - (a.y0 - o.y0) * (b.x0 - o.x0);
        }
        if (std::abs(area) <= static_cast<double>(end - begin) * kPlaneError * size_ * size_) return false;
        int others = 0;
        if (!winding_of_others(begin, loop, others) || others != (area > 0.0 ? 0 : 1)) return false;
        begin = end;
    }
    return true;
}

bool ContourTest::is_simple(const ContourView& contour, const SurfaceMotion& motion, const Vec3& direction) {
    project(contour, motion, direction);
    if (!std::isfinite(size_)) return false;
    make_sides(contour);
    return turns_clear(contour) && winding_is_simple(contour) && sides_stay_apart();
}

} // namespace trocar::collision
