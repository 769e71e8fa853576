// The rod against answers that are known: one function for each, which the tests and the tables share. Each makes its own rod and returns what
// it measured; none is part of a step. segments   of the free length.
#pragma once

#include "fem/rod/closed_forms.hpp"
#include "fem/rod/rod.hpp"

namespace trocar::fem {

/// Tip in lengths: of a clamped rod under a force, P L^2 / (E I), and under its weight, w L^3 / (E I).
[[nodiscard]] ElasticaTip loaded_tip(int segments, double load);
[[nodiscard]] ElasticaTip heavy_tip(int segments, double weight);

/// Tip of the arc of 45 degrees, in its own unit: kBend45Tip.
[[nodiscard]] Vec3 bend45_tip(int segments);

/// Gap of a rod that a moment 2 pi E I / L rolls up to a circle, [-] of its length. The moment acts as the rest curvature that it gives.
[[nodiscard]] double rolled_gap(int segments);

/// Where a disturbance neither grows nor dies away: M L / (E I) of a straight rod twisted between clamps, the tip free to come nearer.
[[nodiscard]] double greenhill_moment(int segments);
/// Twist of a closed ring in rad times G J / (2 pi E I): sqrt(3) (Michell 1889).
[[nodiscard]] double michell_twist(int segments);
/// w L^3 / (E I) of an upright rod.
[[nodiscard]] double column_weight(int segments);

struct BuckledHelix {
    double moment = 0.0, tension = 0.0; // M L / (E I), T L^2 / (E I)
    double envelope = 0.0;              // [-] largest distance of (1 - cos(theta)) over its own largest from sech^2
    double moving = 0.0;                // [-] kinetic energy over that of bending: it has not come to rest
};
/// A rod wound by 27 turns whose ends have come together by 3 % of its length, laid as the closed form says and let go for two seconds;
/// G J / (E I) 0.789 / 1.345.
[[nodiscard]] BuckledHelix buckle_helix(int segments);

/// Amplitude of a bowed tip that turns at `share` of kWhirlingSpeed with a drag of 0.3 of it, over the bow at rest.
[[nodiscard]] double whirl_ratio(int segments, double share);
inline constexpr double kWhirlDamping = 0.3; // [-] of kWhirlingSpeed

/// A bent tip in a bent tube, turned by its handle.
struct Whip {
    double beta = 0.0;        // of the tube and tip: above 1 it snaps
    double handle = 0.0;      // rad, of the handle when the tip was turned fastest
    double jump = 0.0;        // rad, largest turn of the tip in one step
    double first_slope = 0.0; // tip over handle, where both are small
    double last = 0.0;        // rad, of the tip behind the handle at the end
    double share = 0.0;       // of the tip, as in turned_tip
};
/// rest_curvature, tube_curvature   1/m, of the last eighth of 160 mm
[[nodiscard]] Whip turn_in_bend(int segments, double rest_curvature, double tube_curvature);

/// T L / (G J) over the wind-up of a straight shaft whose end a torque T turns.
[[nodiscard]] double wound_by_torque(int segments);

} // namespace trocar::fem
