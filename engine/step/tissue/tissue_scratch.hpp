// Scratch of the tissue's stages: sized in the first steps, reused afterwards, worthless once the step has ended.
#pragma once

#include "engine/step/contact/contact_rows.hpp"
#include "fem/tissue/implicit.hpp"
#include "fem/tissue/lockstep.hpp"

namespace trocar::engine {

/// Where a body stood at the start of the step.
struct BodyStart {
    fem::TissueState tissue;
    std::vector<Vec3> surface; // [vertex_count] m
    double contact_work = 0.0; // J, BodyState::contact_work
    bool may_wait = false;     // nothing can meet it: its surface is evaluated when somebody asks for it
};

/// Of a deformable body.
struct TissueScratch {
    fem::RkWorkspace rk;
    fem::ImplicitWorkspace implicit;
    fem::AdvanceReport advanced;       // its last integration
    fem::IntegrateInputs inputs;       // views of what is here
    std::vector<Vec3> pinned_target; // of effects: see TissueLoads
    std::vector<Vec3> force, force_rate; // likewise
    std::vector<fem::FacePressure> pressures; // likewise
    fem::ContactSprings springs;     // likewise; those of contact follow them
    fem::ContactSprings contact;     // what instruments and hands push it with in this step
};

/// A body among those that contact joins in this step.
struct IslandBody {
    Index parent = 0;          // union-find: towards the lowest body of its island
    bool is_free = true;       // no contact joins it
    bool is_new = false;       // its island has grown since it was integrated
    bool is_instead = false;   // it is in one because implicit steps did not converge
    bool has_free_end = false; // the next two are of this step
    fem::TissueState free_end; // where it came by itself
    fem::AdvanceReport free_advanced;
};

struct IslandsScratch {
    std::vector<IslandBody> body;             // [body_count]
    std::vector<std::uint8_t> joined;         // [contacts] presses, or would
    std::vector<std::size_t> members;         // of the island in hand
    std::vector<fem::TissueLockstep> lockstep; // [members]
    std::vector<fem::ImplicitBody> implicit;   // [members] of bodies that are joined, without contact
    std::vector<fem::TiedBodies> ties;         // among the members
    ContactSolver solver;
};

struct BodiesScratch {
    std::vector<BodyStart> start;      // [body_count]
    std::vector<std::vector<double>> effects_t0; // what effects keep (State::effects), at the start of the step: for one that fails
    std::vector<TissueScratch> tissue; // [body_count]
    ContactScratch contact;
    IslandsScratch islands;
};

} // namespace trocar::engine
