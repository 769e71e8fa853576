// Working memory of the step: sized in the first steps, reused afterwards. Nothing here outlives a step in meaning, except
// the contact springs and planes, which are the last step's answer that this step's integration feels.
#pragma once

#include "base/inside.hpp"
#include "collision/interruptible_search.hpp"
#include "engine/step/report.hpp"
#include "engine/step/state.hpp"
#include "fem/integrate.hpp"
#include "fem/stable_step.hpp"
#include "spheretree/descent.hpp"

#include <optional>

namespace seldinger::engine {

/// Where a rod's plane presses on a wall.
struct WallPress {
    Index triangle = kNoIndex;                   // of the lumen's surface; kNoIndex: nowhere
    std::array<double, 3> bary{1.0, 0.0, 0.0};
};

struct BodyScratch {
    fem::TissueState tissue_t0;
    std::vector<Vec3> surface_t0;                // [vertex_count] m
    fem::LinkFrames frames;
    fem::RkWorkspace rk;
    fem::StableStepWorkspace stable;
    fem::ContactSprings springs;                 // made by the last step's response
    std::vector<Vec3> pinned_target;
    std::vector<spheretree::Sphere> spheres;     // solid bodies, over the step
    std::vector<Index> deepest;                  // [sphere_count] solid bodies, scratch of the response
    spheretree::LumenState lumen;                // hollow bodies
    collision::DopTree tree;                     // hollow bodies, swept over the step
    std::vector<Index> moving;                   // vertices that are not static: what a refit looks at
    InsideTest inside;                           // hollow bodies: the independent check
};

/// Somebody holds a point of a surface and pulls it towards a place.
struct Pull {
    std::size_t body = 0;            // of the model
    Index vertex = 0;                // of its surface
    Vec3 target = Vec3::Zero();      // m
};

struct InstrumentScratch {
    fem::RodState rod_t0;
    std::vector<Vec3> skin_t0;
    std::vector<Vec3> axis;                      // [node_count]
    fem::RodWorkspace rod;
    fem::RodReport rod_report;
    DriveCommand command;
    std::optional<DriveCommand> hand;            // what somebody's hand wants, in place of the script
    bool hand_stopped = false;                   // in the last step: the motion that the hand asked for met the wall
    Route route;                                 // where it is now
    fem::LinkFrames route_frames;
    spheretree::ChainState chain;
    std::vector<spheretree::Sphere> links_t0, links_t1;
    std::vector<fem::RodPlane> planes;           // of the last solve
    std::vector<WallPress> presses;              // [planes]
    collision::DopTree tree;                     // of the skin, swept over the step
    ExactForecast forecast;
};

struct StepContext {
    std::vector<BodyScratch> bodies;
    std::vector<InstrumentScratch> instruments;
    spheretree::Descent descent;
    collision::InterruptibleSearch search;
    std::vector<Contact> coarse; // of this step
    std::vector<Contact> exact;  // of this step; the last round's
    std::vector<Contact> contacts; // what the response pushed against: what pictures and counts show
    std::optional<Pull> pull;    // felt in every step until it is let go
    StepReport report;
};

[[nodiscard]] StepContext make_step_context(const SceneModel& model, const State& state);

} // namespace seldinger::engine
