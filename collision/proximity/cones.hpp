// Cones of directions: bounds kept by a node of a hierarchy on its faces' normals, or on the directions of its vertices' motion.
// source   Provot, "Collision and self-collision handling in cloth model dedicated to design garments" (1997), cones merged bottom-up;
//          Sederberg, Meyers, "Loop detection in surface patch intersections" (1988), the smallest cone that holds two, which is used
//          here: Provot's (half the angle between the axes plus the wider cone) opens faster with every level;
//          Mezger, Kimmerle, Etzmuss, "Hierarchical techniques in collision detection for cloth animation" (2003), section 5.
#pragma once

#include "base/vec.hpp"

#include <cmath>

namespace trocar::collision {

/// All directions within a half angle of an axis. The angle is kept as its cosine and sine, so that no trigonometry is needed.
struct Cone {
    enum class Kind : std::uint8_t { Nothing, Some, Everything };
    Vec3 axis = Vec3::UnitX();       // unit
    double cosine = 1.0, sine = 0.0; // of the half angle, in [0, kWidest]
    Kind kind = Kind::Nothing;

    [[nodiscard]] static Cone everything() noexcept { return {.kind = Kind::Everything}; }
    /// direction   finite; where it is zero, or so small or large that its length is not a normal number: everything
    [[nodiscard]] static Cone around(const Vec3& direction) noexcept {
        const double length = direction.norm();
        if (!(length > 1e-150 && length < 1e150)) return everything();
        return {.axis = direction / length, .kind = Kind::Some};
    }
};

/// Cosine of the widest half angle that a cone may have, pi/2 - 0.005: a wider one is Everything. So every direction of a cone has a
/// scalar product of at least 0.005 with its axis, which is far above all rounding here.
inline constexpr double kWidestCosine = 0.005;
/// Each join opens the cone by this angle more, rad. The axes are unit and the sines and cosines accurate to a few 1e-16; the square root
/// of (1 + cos) / 2 is taken of at least 6e-6, which makes 1e-16 an angle of less than 1e-13 at worst.
inline constexpr double kConeRounding = 1e-11;

/// A cone that holds both, the smallest one up to rounding.
[[nodiscard]] inline Cone join(const Cone& a, const Cone& b) noexcept {
    if (a.kind == Cone::Kind::Nothing || b.kind == Cone::Kind::Everything) return b;
    if (b.kind == Cone::Kind::Nothing || a.kind == Cone::Kind::Everything) return a;
    const Cone &wide = a.cosine <= b.cosine ? a : b, &slim = a.cosine <= b.cosine ? b : a;
    const double half_cos = 0.5 * (wide.axis + slim.axis).norm(), half_sin = 0.5 * (wide.axis - slim.axis).norm();
    const double between_cos = half_cos * half_cos - half_sin * half_sin, between_sin = 2.0 * half_cos * half_sin;
    // reach: how far the slim one goes from the wide one's axis
    const double reach_cos = between_cos * slim.cosine - between_sin * slim.sine;
    const double reach_sin = between_sin * slim.cosine + between_cos * slim.sine;
    if (reach_sin >= 0.0 && reach_cos >= wide.cosine) return wide;
    // twice the new half angle: reach + wide, below pi
    const double twice_cos = reach_cos * wide.cosine - reach_sin * wide.sine, twice_sin = reach_sin * wide.cosine + reach_cos * wide.sine;
    if (reach_sin < 0.0 || twice_sin < 0.0 || 1.0 + twice_cos <= 2.0 * kWidestCosine * kWidestCosine) return Cone::everything();
    // the axis turns towards the slim one by half of reach - wide, which is below pi/2
    const double turn2_cos = reach_cos * wide.cosine + reach_sin * wide.sine, turn2_sin = reach_sin * wide.cosine - reach_cos * wide.sine;
    Cone joined{.kind = Cone::Kind::Some};
    joined.cosine = std::sqrt(0.5 * (1.0 + twice_cos));
    joined.sine = 0.5 * twice_sin / joined.cosine;
    const double turn_cos = std::sqrt(0.5 * (1.0 + turn2_cos)), turn_sin = 0.5 * turn2_sin / turn_cos;
    const Vec3 aside = slim.axis - between_cos * wide.axis;
    const double aside_length = aside.norm();
    if (aside_length > 1e-7) { // else the axes agree, and the wide cone was opened by what is between them all the same
        joined.axis = turn_cos * wide.axis + (turn_sin / aside_length) * aside;
        joined.axis /= joined.axis.norm();
    } else {
        joined.axis = wide.axis;
        const double cosine = wide.cosine - 2e-7 * wide.sine;
        joined.sine = wide.sine + 2e-7 * wide.cosine;
        joined.cosine = cosine;
    }
    const double cosine = joined.cosine - kConeRounding * joined.sine, sine = joined.sine + kConeRounding * joined.cosine;
    // kept on the circle: 1 + cos would amplify a drift where the cone is wide
    const double scale = 1.0 / std::sqrt(cosine * cosine + sine * sine);
    joined.cosine = cosine * scale;
    joined.sine = sine * scale;
    return joined.cosine >= kWidestCosine ? joined : Cone::everything();
}

/// Where the vertices of a node go in one step: "direction, spread, top speed" of the paper, with what a bound needs in addition.
/// Lengths are displacements over the step, m, so that no time step is needed.
struct VelocityCone {
    Cone heading;                        // of the significant vertices
    double fastest = 0.0, slowest = 0.0; // m, of the significant vertices; unset where there are none
    double slow = 0.0;                   // m, none of the other vertices moves farther

    [[nodiscard]] bool has_significant() const noexcept { return heading.kind != Cone::Kind::Nothing; }
};

/// significance   m, vertices that move less count as slow
[[nodiscard]] inline VelocityCone make_velocity_cone(const Vec3& displacement, double significance) noexcept {
    const double length = displacement.norm() * (1.0 + 1e-15);
    if (length < significance || !(length > 0.0)) return {.heading = {}, .slow = length};
    return {.heading = Cone::around(displacement), .fastest = length, .slowest = length * (1.0 - 2e-15)};
}

[[nodiscard]] inline VelocityCone join(const VelocityCone& a, const VelocityCone& b) noexcept {
    VelocityCone joined{.heading = join(a.heading, b.heading), .slow = a.slow < b.slow ? b.slow : a.slow};
    if (!a.has_significant() || !b.has_significant()) {
        const VelocityCone& one = a.has_significant() ? a : b;
        joined.fastest = one.fastest;
        joined.slowest = one.slowest;
        return joined;
    }
    joined.fastest = a.fastest < b.fastest ? b.fastest : a.fastest;
    joined.slowest = a.slowest < b.slowest ? a.slowest : b.slowest;
    return joined;
}

/// Farthest that a displacement of the cone can be from that of its fastest along the axis, m; 0 cones: from nothing.
[[nodiscard]] inline double spread_of(const VelocityCone& cone) noexcept {
    if (!cone.has_significant()) return cone.slow;
    if (cone.heading.kind == Cone::Kind::Everything) return 2.0 * cone.fastest * (1.0 + 1e-12);
    // |u w - v c| for a speed u in [slowest, v] and an angle of at most phi is convex in u: largest at one of the ends
    const auto away = [&](double u) {
        return std::sqrt((u - cone.fastest) * (u - cone.fastest) + 2.0 * u * cone.fastest * (1.0 - cone.heading.cosine));
    };
    double spread = away(cone.fastest) < away(cone.slowest) ? away(cone.slowest) : away(cone.fastest);
    if (cone.slow > 0.0 && spread < cone.fastest + cone.slow) spread = cone.fastest + cone.slow;
    return spread * (1.0 + 1e-9) + 1e-7 * cone.fastest;
}

/// No vertex of one moves relative to one of the other farther than this during the step, m.
[[nodiscard]] inline double relative_motion_bound(const VelocityCone& a, const VelocityCone& b) noexcept {
    const Vec3 main_a = a.has_significant() ? Vec3(a.fastest * a.heading.axis) : Vec3(Vec3::Zero());
    const Vec3 main_b = b.has_significant() ? Vec3(b.fastest * b.heading.axis) : Vec3(Vec3::Zero());
    return ((main_a - main_b).norm() + spread_of(a) + spread_of(b)) * (1.0 + 1e-12);
}

} // namespace trocar::collision
