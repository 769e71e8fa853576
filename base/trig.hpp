// Sine and cosine without libm, so that their bits are the same on every machine and library version.
#pragma once

#include "base/vec.hpp"

namespace trocar {

struct SinCos {
    double sin, cos;
};

/// Error at most 2 units in the last place for |x| <= 1e4 rad. Further out the absolute error grows like |x| 1e-16 and beyond
/// 1e9 rad, and for infinities and NaN, both are NaN.
/// source   range reduction by Cody & Waite 1980 with pi/2 in three parts, Taylor polynomials on [-pi/4, pi/4]
[[nodiscard]] SinCos sin_cos(double x) noexcept;

/// Right-handed rotation about a unit axis. source: Rodrigues' formula.
[[nodiscard]] Mat3 rotation_about(const Vec3& unit_axis, double angle) noexcept;

} // namespace trocar
