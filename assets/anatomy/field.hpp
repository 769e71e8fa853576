// A smooth implicit shape: negative inside, zero on the surface, about metric near it.
#pragma once

#include "base/vec.hpp"

namespace trocar::anatomy {

class Field {
public:
    virtual ~Field() = default;

    /// m, negative inside; magnitude about the distance near the surface.
    [[nodiscard]] virtual double value(const Vec3& p) const = 0;

    /// Finite differences over the corners of a small tetrahedron: four evaluations, error O(step).
    [[nodiscard]] Vec3 gradient(const Vec3& p) const {
        constexpr double kStep = 1e-5; // m, far below any feature and far above rounding
        const Vec3 corner[4] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
        Vec3 sum = Vec3::Zero();
        for (const Vec3& c : corner) sum += c * value(p + kStep * c);
        return sum / (4 * kStep);
    }

    /// First-order distance to the surface, also where the field is not metric.
    [[nodiscard]] double distance(const Vec3& p) const {
        const double slope = gradient(p).norm();
        return slope > 1e-6 ? value(p) / slope : value(p);
    }
};

/// Blends over |a - b| < width, C2 (cubic): never above min(a, b), and equal to it outside the blend.
/// source  Quilez 2013, "smooth minimum"
[[nodiscard]] inline double smooth_min(double a, double b, double width) noexcept {
    const double low = a < b ? a : b;
    const double gap = a < b ? b - a : a - b;
    if (!(gap < width)) return low;
    const double h = (width - gap) / width;
    return low - h * h * h * width * (1.0 / 6.0);
}
[[nodiscard]] inline double smooth_max(double a, double b, double width) noexcept { return -smooth_min(-a, -b, width); }

/// 0 below `from`, 1 above `to`, C1 between.
[[nodiscard]] inline double smooth_ramp(double x, double from, double to) noexcept {
    if (!(x > from)) return 0.0;
    if (x >= to) return 1.0;
    const double t = (x - from) / (to - from);
    return t * t * (3 - 2 * t);
}

} // namespace trocar::anatomy
