// Places where solids may push one another during a step (SolidContact) as the solver sees them: on the tetrahedra beneath them.
#pragma once

#include "engine/state/state.hpp"
#include "engine/step/contact/contact_solver.hpp"

namespace trocar::engine {

/// Sized before the first step.
struct ContactScratch {
    std::vector<std::vector<Index>> vertex_tet; // [body_count][vertex_count] tetrahedron of the owner beneath a vertex; kNoIndex: none
    std::vector<ContactRow> rows;               // of this step, as State's contacts
    std::vector<ContactRow> solved;             // those of the island in hand
    std::vector<Index> row_of;                  // [solved] in rows
    std::vector<GivingBody> bodies;             // [slots]
    std::vector<std::uint32_t> slot;            // [body_count] of the island in hand
};

/// Tetrahedra beneath the vertices of solids that something can touch.
void prepare_contact(const SceneModel& model, ContactScratch& scratch);

/// One row for each of the state's contacts, where the bodies stand at the start of the step.
void make_rows(const SceneModel& model, const State& state, ContactScratch& scratch);

/// m; the gap of a place where the nodes of both bodies stand now, `time` s after the step's start.
[[nodiscard]] double find_gap(const SceneModel& model, const ContactRow& row, double time, const State& state) noexcept;

} // namespace trocar::engine
