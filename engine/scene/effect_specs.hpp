// Settings of effects that the step reads as the scene says them.
#pragma once

#include "base/vec.hpp"

namespace trocar::engine {

/// Breathing moves the fixed nodes of every deformable body along a direction, there and back once a period.
struct BreathingSpec {
    double amplitude = 0.010;       // m, end to end
    double period = 4.0;            // s
    Vec3 direction = Vec3::UnitZ(); // unit, towards the head: expiration
};

/// The walls of hollow bodies widen and narrow with the heart, along BodyModel::pulse_reach.
struct PulseSpec {
    double amplitude = 0.05; // [-] of the local radius, diastole to systole
    double period = 0.9;     // s
};

/// What the blood is like; how it flows is BodyModel::blood.
struct Blood {
    double density = 1060.0;   // kg/m^3
    double viscosity = 3.5e-3; // Pa s, of whole blood where it is sheared fast
    double pulsatility = 0.0;  // [-] the speed varies by this share of its mean, most when the pulse has widened the walls
    double period = 0.9;       // s, of the pulse
};

} // namespace trocar::engine
