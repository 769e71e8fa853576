// The frame of a link triangle: unit n = (q1 - q0) x (q2 - q0), q1 - q0, a = (q1 - q0) x n.
#pragma once

#include "base/vec.hpp"

#include <Eigen/Dense>

#include <cmath>

namespace trocar::fem {

/// Sine of the angle at q0 below which a triangle has no frame: its normal would be rounding.
inline constexpr double kCollapsedSine = 1e-4;

struct LinkTriangle {
    Vec3 q0, q1, q2;
};

/// In an order of its own, which the vectorised frames share.
[[nodiscard]] inline double sum_of_squares(const Vec3& v) noexcept { return (v[0] * v[0] + v[1] * v[1]) + v[2] * v[2]; }

/// axes: orthonormal columns n, q1 - q0, a. False (axes untouched) when the triangle has collapsed or is not finite.
[[nodiscard]] inline bool find_axes(const LinkTriangle& t, Mat3& axes) noexcept {
    const Vec3 e = t.q1 - t.q0, f = t.q2 - t.q0;
    const Vec3 n = e.cross(f);
    const double e_sq = sum_of_squares(e), n_sq = sum_of_squares(n);
    if (!(n_sq > kCollapsedSine * kCollapsedSine * e_sq * sum_of_squares(f)) || !std::isfinite(n_sq)) return false;
    const double per_n = 1.0 / std::sqrt(n_sq), per_e = 1.0 / std::sqrt(e_sq);
    axes.col(0) = n * per_n;
    axes.col(1) = e * per_e;
    axes.col(2) = e.cross(n) * (per_n * per_e); // e and n are perpendicular: unit by construction
    return true;
}

} // namespace trocar::fem
