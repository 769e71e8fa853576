// What a rod is built of, and the fluid that it lies in: what is said of it from outside. rod_model.hpp is what is made of that.
#pragma once

#include "base/vec.hpp"

#include <cstdint>
#include <vector>

namespace trocar::fem {

enum class TipShape : std::uint8_t { Straight, J, Simmons, Pigtail };

/// Stiffness along the rod, linear between rows, held beyond the first and the last.
struct StiffnessRow {
    double from_tip = 0.0; // m, arc length from the tip, ascending
    double factor = 1.0;   // [-] of the Young's modulus, > 0
};

/// N s/m^2, across a slender rod in blood of 3.5 mPa s whose vessel is four times as wide: twice viscous_resistance.
inline constexpr double kBloodDrag = 0.03;

struct RodDesign {
    double length = 0.5;          // m
    double radius = 0.5e-3;       // m, outer
    double segment = 2e-3;        // m, distance of nodes
    double young_modulus = 100e6; // Pa, of the solid circular section
    double density = 1100.0;      // kg/m^3
    double drag = 40.0;           // 1/s, mass-proportional
    double transverse_drag = kBloodDrag; // N s/m^2, per metre of rod, across its axis only: of a fluid that is at rest
    TipShape tip = TipShape::J;
    double tip_length = 15e-3;           // m, of the shaped distal part
    double tip_angle = 0.8;              // rad, total rest bend of the shaped part
    double tip_stiffness = 0.3;          // [-] modulus of the shaped part relative to the shaft, blended over as much again
    std::vector<StiffnessRow> stiffness; // empty: tip_stiffness says it; else instead of that, of stretch and twist as well
    bool torsion = false;                // the rod twists: a turn of the handle travels and winds it up
    double poisson_ratio = 0.4;          // [-] with torsion: shear modulus E / (2 + 2 nu)
};

/// rad a node of a pigtail; a polygon with sharper corners is no loop.
inline constexpr double kSharpestNode = 0.8;

/// Of the fluid at one node of a rod.
struct RodFlow {
    Vec3 velocity = Vec3::Zero(); // m/s, undisturbed
    double viscous = 0.0;         // N s/m^2, along the axis; twice that across it
    double form = 0.0;            // kg/m^2, times the square of the speed across the axis
};

} // namespace trocar::fem
