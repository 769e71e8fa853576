// Clearance of a point in a union of balls, beyond what one ball proves: two overlapping balls also hold every ball through
// the circle where they meet. Without it an instrument along a row of balls would meet a bump between any two of them.
#pragma once

#include "spheretree/sphere_tree.hpp"

#include <cmath>

namespace trocar::spheretree {

struct Clearance {
    double radius = -std::numeric_limits<double>::infinity(); // m, of the ball around p that is proven free; negative: p
                                                              // lies that far outside the best ball
    Vec3 inward = Vec3::UnitX();                              // unit, towards more clearance
};

/// What the ball alone proves.
[[nodiscard]] inline Clearance clearance_in_ball(const Vec3& p, const Sphere& ball) noexcept {
    const Vec3 to_centre = ball.centre - p;
    const double distance = to_centre.norm();
    return {ball.radius - distance, distance > 0.0 ? Vec3(to_centre / distance) : Vec3(Vec3::UnitX())};
}

/// Takes what the pair proves where that is more. Balls a and b meet in a circle of radius rho in the plane at h from a's
/// centre. Any ball through that circle with its centre between theirs lies in their union, for on a's side of the plane
/// it lies in a, and on b's side in b. The best of them for p is centred on the line from the nearest point q of the
/// circle through p: the clearance is |p - q|.
inline void improve_clearance(const Vec3& p, const Sphere& a, const Sphere& b, Clearance& clearance) noexcept {
    const Vec3 across = b.centre - a.centre;
    const double distance = across.norm();
    if (!(distance > 0.0) || a.radius < 0.0 || b.radius < 0.0) return;
    const double h = 0.5 * (distance + (a.radius - b.radius) * (a.radius + b.radius) / distance);
    const double rho_sq = a.radius * a.radius - h * h;
    if (!(h > 0.0 && h < distance && rho_sq > 0.0)) return;
    const Vec3 axis = across / distance;
    const double along = (p - a.centre).dot(axis);
    const Vec3 off_axis = p - a.centre - along * axis;
    const double d = off_axis.norm(), rho = std::sqrt(rho_sq);
    if (!(d > 0.0 && d < rho)) return;
    const double centre = h + (along - h) * rho / (rho - d); // of the best ball, along the axis
    if (centre < 0.0 || centre > distance) return;
    const Vec3 from_circle = (along - h) * axis + (d - rho) / d * off_axis;
    const double radius = from_circle.norm();
    if (radius > clearance.radius) clearance = {radius, from_circle / radius};
}

} // namespace trocar::spheretree
