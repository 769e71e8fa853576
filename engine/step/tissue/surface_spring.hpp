// A force on a place of a surface that organs carry: a spring on the coarse nodes that its vertices hang on.
#pragma once

#include "engine/state/state.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"

#include <limits>
#include <span>

namespace trocar::engine {

/// What pushes a place of a surface along `direction` (unit) while its gap is negative.
struct SurfacePush {
    std::size_t body = 0;            // with links
    std::span<const Index> vertices; // the place, as a mean of vertices
    std::span<const double> weights; // [vertices], sum 1
    Vec3 direction = Vec3::UnitX();
    double gap = 0.0;                                       // m, now; closes and opens as the nodes carry the place along `direction`
    double stiffness = 0.0;                                 // N/m
    double damping = 0.0;                                   // N s/m, on approach
    double limit = std::numeric_limits<double>::infinity(); // N
    double rate = 0.0;                                      // m/s, of the gap, by what it stands against
    bool holds = false;                                     // it takes hold of the tissue there (fem::spread_hold): of momentum the sum is kept alone
};

/// Adds a spring to the owner's of this step; the nodes get the force through the transpose of the links' derivative, so that
/// momentum is kept. False if no vertex hangs on a node: nothing was added.
bool add_surface_spring(const SceneModel& model, const SurfacePush& push, const State& state, BodiesScratch& bodies);

} // namespace trocar::engine
