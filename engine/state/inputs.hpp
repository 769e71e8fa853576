// What somebody does during a step. A step without any is that of the scene's script.
#pragma once

#include "engine/state/state.hpp"

namespace trocar::engine {

/// Somebody holds a point of a surface and pulls it towards a place.
struct Pull {
    std::size_t body = 0;       // of the model
    Index vertex = 0;           // of its surface
    Vec3 target = Vec3::Zero(); // m
};

/// Effects of the scene that a run can do without for a while. What the scene does not have is not switched on.
struct LiveEffects {
    bool elasticity = true;
    bool gravity = true;
    bool coarse_contact = true; // and self_contact with it
    bool exact_contact = true;
    double breathing = 1.0; // [0, 1] share of the amplitude; a switch that goes over many steps does not throw the organ
};

/// A scene knows nothing of it: only the same inputs at the same steps repeat such a run.
struct Inputs {
    /// [instrument_count], or empty: nobody drives. In place of an instrument's script; it moves as fast as the instrument's limits allow,
    /// towards any finite place.
    std::vector<std::optional<DriveCommand>> drive;
    std::optional<Pull> pull; // of a vertex that no tissue carries: it is held, and does not move
    LiveEffects live;
    std::optional<BudgetLimits> budget; // of this step, in place of the simulator's
};

} // namespace trocar::engine
