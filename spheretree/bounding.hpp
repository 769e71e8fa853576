// Small balls around balls. Offline and in the step: no allocation, no libm beyond sqrt.
#pragma once

#include "spheretree/sphere_tree.hpp"

#include <cmath>

namespace trocar::spheretree {

/// Rounding of a distance and a sum stays far below this, so a radius grown by it bounds what it was computed from.
inline constexpr double kRoundOut = 1.0 + 1e-12;

/// Radius around `centre` that holds all balls; -1 where there is none.
[[nodiscard]] inline double enclosing_radius(const Vec3& centre, std::span<const Sphere> balls) noexcept {
    double radius = -1.0;
    for (const Sphere& ball : balls)
        if (ball.radius >= 0.0) radius = std::max(radius, (ball.centre - centre).norm() + ball.radius);
    return radius * (radius > 0.0 ? kRoundOut : 1.0);
}

/// Ball around balls, a few per cent larger than the smallest one. Empty balls are ignored; none left: empty.
/// source   Badoiu & Clarkson 2003, "Smaller core-sets for balls": walk towards the farthest ball with shrinking steps.
[[nodiscard]] Sphere enclose(std::span<const Sphere> balls, unsigned rounds = 24) noexcept;

/// The smallest ball around two.
[[nodiscard]] inline Sphere enclose_two(const Sphere& a, const Sphere& b) noexcept {
    if (a.radius < 0.0) return b;
    if (b.radius < 0.0) return a;
    const Vec3 across = b.centre - a.centre;
    const double distance = across.norm();
    if (distance + b.radius <= a.radius) return a;
    if (distance + a.radius <= b.radius) return b;
    const double radius = 0.5 * (distance + a.radius + b.radius);
    return {a.centre + across * ((radius - a.radius) / distance), radius * kRoundOut};
}

} // namespace trocar::spheretree
