// Scratch of the tissue's stages: sized in the first steps, reused afterwards, worthless once the step has ended.
#pragma once

#include "engine/state/state.hpp"
#include "fem/tissue/integrate.hpp"

namespace trocar::engine {

/// Where a body stood at the start of the step.
struct BodyStart {
    fem::TissueState tissue;
    std::vector<Vec3> surface; // [vertex_count] m
    bool may_wait = false;     // nothing can meet it: its surface is evaluated when somebody asks for it
};

/// Of a deformable body.
struct TissueScratch {
    fem::RkWorkspace rk;
    fem::ContactSprings other_springs; // of those, what is not contact between solids: of a body whose solids' springs wait
    bool springs_met = false;          // and one of them would be pressed: it is integrated again with them
    bool springs_deferred = false;     // it was integrated without its solids' springs: nothing touched it in the step
    fem::AdvanceReport advanced;       // its last integration
    std::vector<Vec3> pinned_target; // of effects: see TissueLoads
    std::vector<Vec3> force;         // likewise
};

struct BodiesScratch {
    std::vector<BodyStart> start;      // [body_count]
    std::vector<TissueScratch> tissue; // [body_count]
};

} // namespace trocar::engine
