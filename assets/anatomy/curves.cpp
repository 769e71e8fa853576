#include "assets/anatomy/curves.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace trocar::anatomy {
namespace {

/// Second derivatives of the natural spline over knots s (Thomas algorithm).
std::vector<Vec3> spline_bends(std::span<const Vec3> p, std::span<const double> s) {
    const std::size_t n = p.size();
    std::vector<Vec3> bend(n, Vec3::Zero()), rhs(n, Vec3::Zero());
    std::vector<double> upper(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const double before = s[i] - s[i - 1], after = s[i + 1] - s[i];
        const double pivot = 2 * (before + after) - before * upper[i - 1];
        upper[i] = after / pivot;
        rhs[i] = (6 * ((p[i + 1] - p[i]) / after - (p[i] - p[i - 1]) / before) - before * rhs[i - 1]) / pivot;
    }
    for (std::size_t i = n - 1; i-- > 1;) bend[i] = rhs[i] - upper[i] * bend[i + 1];
    return bend;
}

} // namespace

std::vector<double> arc_lengths(std::span<const Vec3> points) {
    std::vector<double> s(points.size(), 0.0);
    for (std::size_t i = 1; i < points.size(); ++i) s[i] = s[i - 1] + (points[i] - points[i - 1]).norm();
    return s;
}

std::vector<Vec3> smooth_curve(std::span<const Vec3> points, double spacing) {
    assert(points.size() >= 2);
    const std::vector<double> s = arc_lengths(points);
    const std::vector<Vec3> bend = spline_bends(points, s);
    std::vector<Vec3> fine;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const double h = s[i + 1] - s[i];
        const int pieces = std::max(2, static_cast<int>(std::ceil(4 * h / spacing)));
        for (int k = 0; k < pieces; ++k) {
            const double b = static_cast<double>(k) / pieces, a = 1 - b;
            fine.push_back(a * points[i] + b * points[i + 1] + ((a * a * a - a) * bend[i] + (b * b * b - b) * bend[i + 1]) * (h * h / 6));
        }
    }
    fine.push_back(points.back());
    return resample(fine, spacing);
}

std::vector<Vec3> resample(std::span<const Vec3> points, double spacing) {
    const std::vector<double> s = arc_lengths(points);
    const auto pieces = static_cast<std::size_t>(std::max(1.0, std::round(s.back() / spacing)));
    std::vector<Vec3> out;
    std::size_t i = 0;
    for (std::size_t k = 0; k < pieces; ++k) {
        const double at = s.back() * static_cast<double>(k) / static_cast<double>(pieces);
        while (i + 2 < points.size() && s[i + 1] <= at) ++i;
        const double h = s[i + 1] - s[i];
        out.push_back(points[i] + (h > 0 ? (at - s[i]) / h : 0.0) * (points[i + 1] - points[i]));
    }
    out.push_back(points.back());
    return out;
}

void relax_bends(std::vector<Vec3>& points, double radius, std::size_t fixed_first) {
    constexpr int kRounds = 4000; // each moves a bend by a quarter of its sagitta
    std::vector<char> sharp(points.size());
    for (int round = 0; round < kRounds; ++round) {
        bool any = false;
        std::fill(sharp.begin(), sharp.end(), char{0});
        for (std::size_t i = std::max<std::size_t>(1, fixed_first); i + 2 < points.size(); ++i) {
            const Vec3 in = points[i] - points[i - 1], out = points[i + 1] - points[i];
            const double bend = 2 * in.cross(out).norm() / (in.norm() * out.norm() * (in + out).norm());
            if (bend * radius <= 1) continue;
            any = true;
            for (std::size_t k = i - 1; k <= i + 1; ++k) sharp[k] = 1;
        }
        if (!any) return;
        for (std::size_t i = std::max<std::size_t>(1, fixed_first); i + 2 < points.size(); ++i)
            if (sharp[i]) points[i] += 0.25 * (points[i - 1] + points[i + 1] - 2 * points[i]);
    }
}

std::vector<double> curvature_radii(std::span<const Vec3> points, double window) {
    const std::vector<double> s = arc_lengths(points);
    std::vector<double> radii(points.size(), std::numeric_limits<double>::infinity());
    std::size_t before = 0, after = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        while (before + 1 < i && s[i] - s[before + 1] >= window) ++before;
        while (after + 1 < points.size() && s[after] - s[i] < window) ++after;
        if (s[i] - s[before] < window || s[after] - s[i] < window) continue;
        const Vec3 in = points[i] - points[before], out = points[after] - points[i];
        const double bend = 2 * in.cross(out).norm() / (in.norm() * out.norm() * (in + out).norm());
        if (bend > 0) radii[i] = 1 / bend;
    }
    return radii;
}

std::size_t nearest_sample(std::span<const Vec3> points, const Vec3& p) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < points.size(); ++i)
        if ((points[i] - p).squaredNorm() < (points[best] - p).squaredNorm()) best = i;
    return best;
}

Vec3 tangent(std::span<const Vec3> points, std::size_t i) {
    const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, points.size() - 1);
    return (points[after] - points[before]).normalized();
}

} // namespace trocar::anatomy
