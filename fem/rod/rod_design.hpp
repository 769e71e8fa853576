// What a rod is built of, the fluid that it lies in, and what pulls on its tip: what is said of it from outside. rod_model.hpp is what is made of that.
#pragma once

#include "base/vec.hpp"

#include <cstdint>
#include <vector>

namespace trocar::fem {

enum class TipShape : std::uint8_t { Straight, J, Simmons, Pigtail, Curve };

/// Has torsion in any case: without it a coil, or a curve that turns far, finds no equilibrium.
[[nodiscard]] constexpr bool always_twists(TipShape tip) noexcept { return tip == TipShape::Pigtail || tip == TipShape::Curve; }

/// A quantity along the rod, linear between rows, held beyond the first and the last.
struct ProfileRow {
    double from_tip = 0.0; // m, arc length from the tip, ascending
    double factor = 1.0;   // [-] of the shaft's
};

/// Piece of a shaped part at rest: a straight line or an arc of a circle.
struct TipArc {
    double length = 0.0; // m
    double angle = 0.0;  // rad, by which it turns; 0: straight
    double plane = 0.0;  // rad about the rod's own axis, of the side to which it turns, in a frame carried along without twist
};

/// N s/m^2, across a slender rod in blood of 3.5 mPa s whose vessel is four times as wide: twice viscous_resistance.
inline constexpr double kBloodDrag = 0.03;

struct RodDesign {
    double length = 0.5;          // m
    double radius = 0.5e-3;       // m, outer
    double segment = 2e-3;        // m, distance of nodes
    double young_modulus = 100e6; // Pa, of the solid circular section that bends as this one does
    double density = 1100.0;      // kg/m^3, of the solid circular section that weighs as much
    double stretch_factor = 1.0;  // [-] of that section's axial stiffness; 1: solid, of one material
    double turn_factor = 1.0;     // [-] of that section's rotary inertia about the axis
    double drag = 40.0;           // 1/s, mass-proportional
    double transverse_drag = kBloodDrag; // N s/m^2, per metre of rod, across its axis only: of a fluid that is at rest
    TipShape tip = TipShape::J;
    double tip_length = 15e-3;           // m, of the shaped distal part
    double tip_angle = 0.8;              // rad, total rest bend of the shaped part
    double tip_stiffness = 0.3;          // [-] modulus of the shaped part relative to the shaft, blended over as much again
    std::vector<TipArc> arcs;            // Curve: from the shaft on; their lengths add up to tip_length
    std::vector<ProfileRow> stiffness;   // empty: tip_stiffness says it; else instead of that, of stretch and twist as well
    std::vector<ProfileRow> coating;     // of the friction; empty: the same everywhere
    bool torsion = false;                // the rod twists: a turn of the handle travels and winds it up
    double poisson_ratio = 0.4;          // [-] with torsion: shear modulus E / (2 + 2 nu)
};

/// rad a node of a pigtail or a curve; a polygon with sharper corners is no loop.
inline constexpr double kSharpestNode = 0.8;

/// A force and a torque on a rod's tip, in a straight line over the step.
struct RodTipLoad {
    Vec3 force = Vec3::Zero(), force_rate = Vec3::Zero(); // N at the step's start, N/s
    double torque = 0.0, torque_rate = 0.0;               // N m about the tip's own axis, of a rod with torsion; N m/s
};

/// Of the fluid at one node of a rod.
struct RodFlow {
    Vec3 velocity = Vec3::Zero(); // m/s, undisturbed
    double viscous = 0.0;         // N s/m^2, along the axis; twice that across it
    double form = 0.0;            // kg/m^2, times the square of the speed across the axis
};

} // namespace trocar::fem
