// Scratch memory of the step, a part for each of its stages: sized in the first steps, reused afterwards, worthless once the step has
// ended. What a step leaves for the next is in State.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/instrument/instrument_scratch.hpp"
#include "engine/step/solid/solid_scratch.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"

namespace trocar::engine {

struct TraversalScratch {
    spheretree::Descent descent;
    std::vector<Contact> coarse; // of this step
};

struct StepScratch {
    BodiesScratch bodies;
    RodsScratch rods;
    SolidScratch solids;
    TraversalScratch traversal;
    EffectSet live;                // of this step
    unsigned dropped = 0;          // effects that this step leaves out for want of time, a bit per Droppable
    std::vector<Contact> contacts; // what the response pushed against: what pictures and counts show
    StepReport report;
};

} // namespace trocar::engine
