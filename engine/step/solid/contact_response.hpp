// How contacts between solid bodies become forces. A response says which places push in the next step: the solver of the tissue's sub-steps
// gives them impulses (contact_solver.hpp). Another one is another class here and a choice of the scene's contact.solid_response.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"

#include <span>

namespace trocar::engine {

/// What a response of one step works with. Everything outlives it.
struct ContactSink {
    const SceneModel& model;
    State& state;
    SolidScratch& solids;
    StepReport& report;

    /// The two places of `touch` do not come nearer to one another along its normal than its gap allows, from the next step on.
    /// recovery   m/s, at which they part where the gap is negative
    void add(const Contact& touch, double recovery);
    /// The two bodies are held as wholes from the next step on (SolidContact::room).
    void hold(const Contact& whole);
};

class ContactResponse {
public:
    virtual ~ContactResponse() = default;

    /// contacts   places where surfaces touch or are about to (find_touches): signed gap at the step's end, normal towards the first body
    /// sink       what the places are added to; sphere pairs of the traversal, for what has no inside, are in sink.solids.coarse
    virtual void respond(std::span<const Contact> contacts, ContactSink& sink) const = 0;
};

/// Surfaces push where they touch, spheres where a surface has none (solid_hold.hpp): `surface`. Or spheres alone, as in the sphere-tree
/// paper: `spheres`, of which there are no places of surfaces.
[[nodiscard]] const ContactResponse& response_of(SolidResponse response) noexcept;

} // namespace trocar::engine
