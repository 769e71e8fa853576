// Scratch of instruments and of the walls that they move in: sized in the first steps, reused afterwards, worthless once the step has
// ended.
#pragma once

#include "base/inside.hpp"
#include "collision/search/interruptible_search.hpp"
#include "engine/state/state.hpp"
#include "engine/step/instrument/cull_stage.hpp"
#include "fem/rod/rod_meetings.hpp"
#include "fem/rod/rod_solver.hpp"
#include "fem/rod/self_contact.hpp"
#include "spheretree/traverse/descent.hpp"

#include <limits>
#include <memory>
#include <span>

namespace trocar::engine {

/// The planes of one side of a place press at so many triangles at most: those that press less are left out.
inline constexpr std::size_t kPressesPerPush = 6;

/// What the tissue was given of one place of a rod in this step: see wall_exchange.hpp.
struct WallPush {
    Index node = 0;
    double weight = 0.0;
    std::uint8_t side = 0;
    std::array<WallPress, kPressesPerPush> press;                        // [press_count] where its planes press, hardest first
    std::array<double, kPressesPerPush> share{};                         // [press_count] of the force, sum 1
    std::size_t press_count = 0;
    double give = 0.0;                                                   // m/N
    bool is_rigid = false;                                               // the rod felt it so
    Vec3 force = Vec3::Zero(), felt = Vec3::Zero(), drag = Vec3::Zero(); // N, on the rod
    Vec3 coming = Vec3::Zero();                                          // m
};

/// Of a hollow body.
struct WallScratch {
    std::span<const Vec3> surface_t0; // [vertex_count] m, at the start of the step: a view of BodyStart
    collision::DopTree tree;          // follows the wall from step to step
    std::uint64_t last_step = kNoStep; // State::step of the motion that the tree follows: one that was missed makes its bounds worthless
    double way = std::numeric_limits<double>::infinity(); // m, longest of a vertex in this step; infinite where it was not measured
    std::vector<Vec3> flow_points;    // [point_count] m, of those whose blood moves along with a host
    InsideTest inside;                // the independent check
    std::vector<double> node_presses; // [node_count] of its host: how many presses a node carries in this step
};

/// Of an instrument at the start of the step, beside its rod, skin and planes: for a step that fails.
struct InstrumentStart {
    FollowState follow;
    bool drive_stopped = false, kept_inside = false;
    std::uint64_t exact_candidates = 0;
    std::vector<fem::RodPlane> self_planes;
};

/// What an exact stage changes beside the rod: put back where its answer is not used.
struct BeforeExact {
    DriveCommand command;
    bool drive_stopped = false, slowed = false;
};

struct InstrumentScratch {
    fem::RodState rod_t0;
    std::vector<Vec3> skin_t0;
    InstrumentStart start;
    std::vector<Vec3> axis; // [node_count]
    fem::RodWorkspace rod;
    fem::RodReport rod_report;
    std::vector<fem::RodPlane> last_planes; // those of the last step, in the order of their places but for those of corrections at the end
    std::vector<WallPress> last_presses;    // [last_planes]
    std::vector<fem::RodPlane> carried_planes; // those that go on, while others are made anew: see carry_response
    std::vector<WallPress> carried_presses;    // [carried_planes]
    std::vector<WallPush> pushes;           // in the order of their places
    std::vector<std::uint8_t> taken;        // [last_planes] a newer plane goes on with its forces
    fem::SelfContact self;    // of this step
    bool meets_itself = false; // in this step
    DriveCommand command;
    bool is_exact = false; // in this step: the exact stage was forced for it
    bool slowed = false;   // in this step, see keep_within_reach
    bool is_met = false;   // in this step: an exact stage ended with contacts left, and its motion is no answer
    BeforeExact before_exact;
    unsigned iterations = 0; // of all solves of this step
    fem::RodModel thicker; // the rod as it is then, in a thicker fluid
    std::vector<fem::RodFlow> flow; // [node_count] of the fluid around it in this step: see RodLoads, as the next three
    std::vector<Vec3> force;
    Vec3 acceleration = Vec3::Zero();
    double friction = 0.0;
    fem::RodTipLoad tip;
    std::optional<fem::RodClamp> clamp; // at the step's end
    std::vector<spheretree::Sphere> links_t0, links_t1;
    std::span<const spheretree::LinkStatus> proven; // [links] what the traversal of this step proved of its links; empty: nothing
    std::vector<std::uint8_t> fresh;   // [2 node_count] their planes are made anew
    std::vector<double> wall_distance; // [2 node_count] m, at t0, at least; negative: not measured; empty: nothing was, in this step
    collision::DopTree tree;           // of the skin, swept over the step
    ExactForecast forecast;
};

struct RodsScratch {
    std::vector<InstrumentScratch> instruments;              // [instrument_count]
    std::vector<WallScratch> walls;                          // [body_count], of hollow bodies
    bool tissue_moves = false;                               // in this step: it feels what presses
    std::vector<std::unique_ptr<fem::RodSolver>> solvers;    // [instrument_count] null: solved with the instrument it runs in
    // With the effect instrument_contact or a rod with play in a bore, of this step:
    bool meet = false;
    bool meet_outside = false; // that effect is on
    std::vector<fem::RodMeeting> meetings_t0;
    std::vector<std::size_t> together; // instruments that are solved together; the first one stands for all; empty: none
    fem::RodMeetings meetings;
    fem::TogetherWorkspace joint;
    collision::InterruptibleSearch search;
    std::unique_ptr<CullStage> cull; // with instruments
    std::vector<Contact> hits;       // of the exact stage of this step; the last round's
};

} // namespace trocar::engine
