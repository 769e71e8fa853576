// Continuous tests in rational arithmetic, slow and simple: the reference of the exact verdicts. Shares nothing with
// them but the input.
#pragma once

#include "collision/ccd/sweep.hpp"

#include <gmpxx.h>

#include <array>
#include <optional>
#include <vector>

namespace trocar::collision::testing {

using Rational = mpq_class;
using RationalPoint = std::array<Rational, 3>;

inline RationalPoint sub(const RationalPoint& a, const RationalPoint& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline RationalPoint cross(const RationalPoint& a, const RationalPoint& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Rational dot(const RationalPoint& a, const RationalPoint& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline bool is_zero(const RationalPoint& a) { return a[0] == 0 && a[1] == 0 && a[2] == 0; }

enum class Verdict { Apart, Meets, Unknown };

/// Four moving points: a vertex and a face, or two edges.
class RationalPair {
public:
    RationalPair(bool vertex_face, const std::array<SweptPoint, 4>& points) : vertex_face_(vertex_face) {
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                t0_[i][axis] = Rational(points[i].t0[static_cast<int>(axis)]);
                t1_[i][axis] = Rational(points[i].t1[static_cast<int>(axis)]);
            }
    }

    std::array<RationalPoint, 4> at(const Rational& t) const {
        std::array<RationalPoint, 4> x;
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t axis = 0; axis < 3; ++axis) x[i][axis] = t0_[i][axis] + t * (t1_[i][axis] - t0_[i][axis]);
        return x;
    }

    /// Do they touch at this time? Segments and triangles of any degeneracy.
    bool touch_at(const Rational& t) const {
        const auto x = at(t);
        return vertex_face_ ? in_triangle(x[0], x[1], x[2], x[3]) : segments_meet(x[0], x[1], x[2], x[3]);
    }

    /// Six times the volume that the four points span.
    Rational volume(const Rational& t) const {
        const auto x = at(t);
        return dot(cross(sub(x[1], x[0]), sub(x[2], x[0])), sub(x[3], x[0]));
    }

    /// Roots of the cubic through four values; rational roots of small denominator exactly, others in an interval of 2^-160: touching
    /// there is decided by a margin, or Unknown.
    Verdict verdict() const;

    /// How far inside the features the meeting point of their planes is, as weights: negative outside. Nothing where degenerate.
    std::optional<Rational> margin(const Rational& t) const;

private:
    static bool on_segment(const RationalPoint& p, const RationalPoint& a, const RationalPoint& b) {
        const RationalPoint u = sub(a, p), v = sub(b, p);
        return is_zero(cross(u, v)) && dot(u, v) <= 0;
    }
    static bool in_triangle(const RationalPoint& p, const RationalPoint& a, const RationalPoint& b, const RationalPoint& c) {
        if (on_segment(p, a, b) || on_segment(p, b, c) || on_segment(p, c, a)) return true;
        const RationalPoint n = cross(sub(b, a), sub(c, a));
        if (is_zero(n) || dot(n, sub(p, a)) != 0) return false;
        const auto side = [&](const RationalPoint& u, const RationalPoint& v) { return dot(cross(sub(v, u), sub(p, u)), n); };
        return side(a, b) >= 0 && side(b, c) >= 0 && side(c, a) >= 0;
    }
    static bool segments_meet(const RationalPoint& a, const RationalPoint& b, const RationalPoint& c, const RationalPoint& d) {
        if (on_segment(a, c, d) || on_segment(b, c, d) || on_segment(c, a, b) || on_segment(d, a, b)) return true;
        const RationalPoint u = sub(b, a), v = sub(d, c), r = sub(c, a), n = cross(u, v);
        if (is_zero(n) || dot(r, n) != 0) return false;
        const Rational nn = dot(n, n), s = dot(cross(r, v), n) / nn, t = dot(cross(r, u), n) / nn;
        return s >= 0 && s <= 1 && t >= 0 && t <= 1;
    }

    bool vertex_face_;
    std::array<RationalPoint, 4> t0_, t1_;
};

inline std::optional<Rational> RationalPair::margin(const Rational& t) const {
    const auto x = at(t);
    if (vertex_face_) {
        const RationalPoint n = cross(sub(x[2], x[1]), sub(x[3], x[1]));
        const Rational nn = dot(n, n);
        if (nn == 0) return std::nullopt;
        std::optional<Rational> least;
        for (std::size_t k = 0; k < 3; ++k) {
            const RationalPoint &u = x[1 + k], &v = x[1 + (k + 1) % 3];
            const Rational w = dot(cross(sub(v, u), sub(x[0], u)), n) / nn;
            if (!least || w < *least) least = w;
        }
        return least;
    }
    const RationalPoint u = sub(x[1], x[0]), v = sub(x[3], x[2]), r = sub(x[2], x[0]), n = cross(u, v);
    const Rational nn = dot(n, n);
    if (nn == 0) return std::nullopt;
    const Rational s = dot(cross(r, v), n) / nn, w = dot(cross(r, u), n) / nn;
    return std::min({s, Rational(1 - s), w, Rational(1 - w)});
}

namespace detail {

using Coefficients = std::array<Rational, 4>; // of 1, t, t^2, t^3

inline Rational value(const Coefficients& c, const Rational& t) { return ((c[3] * t + c[2]) * t + c[1]) * t + c[0]; }

/// Interpolates values at 0, 1, 2, 3.
inline Coefficients through(const std::array<Rational, 4>& y) {
    const Rational d1 = y[1] - y[0], d2 = y[2] - 2 * y[1] + y[0], d3 = y[3] - 3 * y[2] + 3 * y[1] - y[0];
    // Newton's forward differences: y0 + d1 t + d2 t (t - 1) / 2 + d3 t (t - 1)(t - 2) / 6
    return {y[0], Rational(d1 - d2 / 2 + d3 / 3), Rational(d2 / 2 - d3 / 2), Rational(d3 / 6)};
}

/// The rational number of smallest denominator in [lo, hi].
inline Rational simplest_between(const Rational& lo, const Rational& hi) {
    mpz_class whole;
    mpz_fdiv_q(whole.get_mpz_t(), lo.get_num_mpz_t(), lo.get_den_mpz_t());
    if (Rational(whole) == lo) return lo;
    if (Rational(whole + 1) <= hi) return Rational(whole + 1);
    return whole + 1 / simplest_between(1 / Rational(hi - whole), 1 / Rational(lo - whole));
}

} // namespace detail

inline Verdict RationalPair::verdict() const {
    using namespace detail;
    const Coefficients p = through({volume(0), volume(1), volume(2), volume(3)});
    if (touch_at(0) || touch_at(1)) return Verdict::Meets;
    if (p[0] == 0 && p[1] == 0 && p[2] == 0 && p[3] == 0) { // always coplanar: test some times only
        for (int k = 1; k < 64; ++k)
            if (touch_at(Rational(k, 64))) return Verdict::Meets;
        return Verdict::Unknown;
    }
    // Between the stationary points the cubic is monotone. Those are bracketed by plain subdivision: intervals whose Taylor bound
    // excludes a root are dropped, the others halved down to 2^-160.
    struct Interval {
        Rational lo, hi;
    };
    std::vector<Interval> open{{0, 1}};
    Rational width = 1;
    for (int depth = 0; depth < 160 && !open.empty(); ++depth) {
        width /= 2;
        std::vector<Interval> next;
        for (const Interval& i : open)
            for (const auto& [lo, hi] : {Interval{i.lo, Rational(i.lo + width)}, Interval{Rational(i.lo + width), i.hi}}) {
                const Rational slope0 = p[1] + lo * (2 * p[2] + 3 * lo * p[3]), curve = 2 * p[2] + 6 * lo * p[3];
                const Rational reach = width * (abs(slope0) + width * (abs(curve) / 2 + width * abs(p[3])));
                if (abs(value(p, lo)) <= reach) next.push_back({lo, hi});
            }
        open = std::move(next);
        if (open.size() > 64) return Verdict::Unknown;
    }
    bool unknown = false;
    const Rational sure = Rational(1, mpz_class(1) << 60);
    for (const Interval& i : open) {
        const Rational root = simplest_between(i.lo, i.hi);
        if (mpz_sizeinbase(root.get_den_mpz_t(), 2) < 60) { // a neighbour of the root's interval has no such number, or the same one
            if (value(p, root) == 0 && touch_at(root)) return Verdict::Meets;
            if (value(p, root) == 0) continue;
        }
        const auto inside = margin(i.lo);
        if (!inside || abs(*inside) < sure)
            unknown = true;
        else if (*inside > 0 && value(p, i.lo) * value(p, i.hi) < 0)
            return Verdict::Meets;
        else if (*inside > 0)
            unknown = true; // a double root, or none at all so near
    }
    return unknown ? Verdict::Unknown : Verdict::Apart;
}

} // namespace trocar::collision::testing
