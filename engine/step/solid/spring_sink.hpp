// Where a response puts its springs: equal and opposite on both bodies, evaluated in every stage of the next step's integration.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"

#include <limits>
#include <span>

namespace trocar::engine {

/// A place of a contact's first or second body, as a mean of vertices.
struct Place {
    std::size_t body;
    std::span<const Index> vertices;
    std::span<const double> weights; // [vertices] sum 1

    /// m, in the step
    [[nodiscard]] Vec3 motion(const SceneModel& model, const State& state, const SolidScratch& solids) const;
};

struct Push {
    Vec3 direction; // unit, of the first body
    double gap, stiffness, damping;                         // m, N/m, N s/m
    double limit = std::numeric_limits<double>::infinity(); // N
    double friction = 0.0;                                  // Coulomb's, of one that holds beneath the load of `under`
    const SpringPair* under = nullptr;                      // null: it does not
};

/// What a response of one step works with. Everything outlives it.
class SpringSink {
public:
    SpringSink(const SceneModel& model_of_scene, State& state_of_step, SolidScratch& scratch, StepReport& step_report) noexcept
        : model(model_of_scene), state(state_of_step), solids(scratch), report(step_report) {}

    /// One contact's spring, or pair of springs: state.solids.springs.back().
    void push(const Place& a, const Place& b, const Push& push);

    const SceneModel& model;
    State& state;
    SolidScratch& solids;
    StepReport& report;
};

} // namespace trocar::engine
