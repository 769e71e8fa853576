// Answers of the theory of rods that are known without a computation of rods, in numbers without a dimension: what fem/rod/validation.hpp
// measures is compared with them. None is part of a step.
#pragma once

#include "base/vec.hpp"

namespace trocar::fem {

/// Tip of a clamped elastica, in lengths of it.
struct ElasticaTip {
    double along = 1.0, across = 0.0;
};

/// Under a force P across its first direction: P L^2 / (E I).
/// source   theta'' = -load cos(theta), by shooting with Runge-Kutta 4
[[nodiscard]] ElasticaTip loaded_elastica(double load);

/// Under its weight w per length, across its first direction: w L^3 / (E I). The same source, with load (1 - s).
[[nodiscard]] ElasticaTip heavy_elastica(double weight);

/// Simo & Vu-Quoc 1986: an arc of 45 degrees, radius 100, E 1e7, nu 0, section 1 x 1, force 600 out of its plane; quoted.
inline const Vec3 kBend45Tip{47.23, 15.79, 53.37};

/// Of a helix that a long rod with clamped ends buckles into, which is localised in its middle.
/// source   van der Heijden & Thompson 2000, of a rod without end; m = M L / (E I), t = T L^2 / (E I)
struct HelicalBuckling {
    double moment = 0.0, tension = 0.0; // m, t
    [[nodiscard]] double spread() const; // 1 - m^2 / (4 t)
    /// 1 - cos(theta) over its largest, at s lengths from the middle: sech^2
    [[nodiscard]] double envelope(double s) const;
};
/// slack   [-] of the length; turn   rad of one end against the other; ratio   G J / (E I)
[[nodiscard]] HelicalBuckling helical_buckling(double slack, double turn, double ratio);

/// M L / (E I) at which a straight rod clamped at both ends, free to shorten, buckles: 2 x with tan(x) = x, 8.9868 (Greenhill 1883).
inline constexpr double kGreenhillMoment = 8.98681891;
/// w L^3 / (E I) at which an upright rod buckles under its own weight (Greenhill 1881).
inline constexpr double kHeavyColumn = 7.83734742;

/// Tip of a rod whose rest shape has a small constant curvature and which is turned about its first direction, over that at rest.
/// speed   omega L^2 sqrt(mass per length / (E I)); damping   the same of a drag in proportion to mass, which the world holds still
[[nodiscard]] double whirling_tip(double speed, double damping);
/// The same speed at which a clamped rod whirls without damping: its first mode's frequency.
inline constexpr double kWhirlingSpeed = 3.51601527;

/// A bent tip in a bent tube, both of constant curvature and without friction, which a handle turns through a straight shaft.
struct TurnedTip {
    double snap = 0.0;  // rad, of the handle, beyond which the tip has no balance near by; infinite: it always has
    double slope = 1.0; // of the middle of the tip over the handle, where both are small
};
/// beta   E I k1 k2 l L / (G J), of tip l and L from the handle to the tip's middle; share   l / L, which is 0 of a tip that does not twist along itself:
/// there cos(phi) = -1 / beta, snap = phi + beta sin(phi) and slope = 1 / (1 + beta)
/// source   Dupont, Lock, Itkowitz & Butler 2010: G J phi'' = E I k1 k2 sin(phi), by shooting from the tip's end with Runge-Kutta 4
[[nodiscard]] TurnedTip turned_tip(double beta, double share);

} // namespace trocar::fem
