// What one step did: asked, done, given up. Every number that steps.csv shows.
#pragma once

#include "base/vec.hpp"
#include "engine/scene/effect.hpp"
#include "engine/time/limits.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace trocar::engine {

/// Wall time by stage, ms.
struct StageTimes {
    double script = 0.0;     // drive commands
    double fem = 0.0;        // integration of the tissue and free motion of the rod
    double steer = 0.0;      // embedded surfaces
    double descend = 0.0;    // sphere trees
    double exact = 0.0;      // continuous tests
    double respond = 0.0;    // contact response, without the exact tests it repeats
    double observe = 0.0;    // independent checks; not part of the step
    double total = 0.0;      // whole step without observe
    double budget = 0.0;     // charged to the budget's scope
    double budget_cpu = 0.0; // the same in this thread's own time: what the operating system gave to others is left out
};

struct StepReport {
    std::uint64_t step = 0;
    double time_s = 0.0; // at the end of the step
    StageTimes ms;
    std::array<AccountEntry, kAccountParts> account; // by AccountPart: sums to ms.budget where the budget covers collision
    EffectCounts effects; // whose code was entered
    unsigned substeps = 0;
    std::uint64_t tet_evaluations = 0; // forces of a tetrahedron, once each: of motion that contact made again too
    double stable_step_s = 0.0; // smallest over the deformable bodies (implicit ones: taken); 0: none

    // coarse
    std::uint64_t pairs_tested = 0, pairs_open = 0, leaf_contacts = 0, assumed = 0;
    int level_reached = 0;
    // exact
    bool exact_ran = false;
    bool exact_forced = false;  // did not fit, but ran all the same: without it the rod would have left the lumen
    bool exact_abandoned = false; // started, but the budget ended first: its answer was thrown away
    std::uint64_t candidates = 0, unresolved = 0;
    std::uint64_t exact_contacts = 0; // that continuous tests found, those that a correction removed included
    std::uint64_t pressing_contacts = 0; // places where an instrument presses on its wall
    unsigned culled_by = 0;           // which candidate filter ran (CulledBy): 0 none, 1 the CPU reference, 2 OpenGL
    std::uint64_t cull_items = 0;     // candidates that it tested
    std::uint64_t cull_apart = 0;     // of them proven apart
    unsigned cull_late = 0;           // filter passes whose answer came after the tests and was dropped
    unsigned cull_left_out = 0;       // filter passes that the scene asks for and the budget had no room for, or that found the device busy
    unsigned corrections = 0;         // times the rod was solved again because a continuous test still hit
    unsigned drive_limited = 0;        // instruments whose drive command was cut: kDriveReach in a step
    unsigned drive_stops = 0;          // instruments whose drive was stopped in this step because its push met the wall
    unsigned clamped_forces = 0;      // always 0: forces are cut neither for the rod nor for the wall
    unsigned slowed_rods = 0;         // instruments that would have moved farther in this step than planes of their wall tell of: dragged
    double rod_stretch = 0.0;         // [-] largest share by which a segment of an instrument is longer or shorter than at rest
    std::uint64_t self_contacts = 0;  // places where instruments press on themselves
    unsigned self_held = 0;           // instruments of whose motion only a part was proven not to pass through themselves, and taken
    std::uint64_t instrument_contacts = 0; // places where instruments press on one another
    unsigned instrument_held = 0;     // instruments of whose motion only a part was proven not to pass through others, and taken
    unsigned beyond_bores = 0;        // places of instruments with play that are beyond their bore by more than a tenth of the play
    unsigned rod_iterations = 0;      // of Newton's method, in all solves of the step and all instruments
    unsigned unsettled_rods = 0;      // stages of rods whose contact forces had not settled when the iteration ended
    double safe_fraction = 1.0;       // < 1: the motion of this step was scaled to this share
    bool within_distance = false; // skin and wall stayed nearer than the exact distance all step: the motion was taken, proven not to touch
    unsigned unproven_links = 0;  // instrument links whose freedom nothing proved in this step

    // state
    // Both where the tissue's integration ends, over all deformable bodies: the ratio is 0 or less if and only if tets are inverted. A step
    // that is scaled ends between there and its start.
    double min_volume_ratio = 1.0;   // [-] smallest det F of a tet
    std::uint32_t inverted_tets = 0; // with det F <= 0
    double kinetic_j = 0.0, elastic_j = 0.0;
    Vec3 tip = Vec3::Zero();
    double insertion_m = 0.0, rotation_rad = 0.0;
    double contact_force_n = 0.0; // sum of normal forces on the walls
    double max_contact_force_n = 0.0;
    double friction_force_n = 0.0;   // sum of friction forces on the walls
    double self_force_n = 0.0;       // sum of normal forces of instruments on themselves
    double instrument_force_n = 0.0; // the same on one another
    double bore_excess_m = 0.0;      // farthest that a place of an instrument with play is beyond the bore that it is in
    double handle_force_n = 0.0;     // of the first instrument: along the port's axis, positive: the drive pushes
    double handle_torque_nm = 0.0;   // of the first instrument: about the port's axis; without torsion that of the shaped tip alone
    double exchange_gap_n = 0.0;     // over all instruments: what they push their walls with at the step's end less what the tissue felt of it
    double balance_n = 0.0;          // over all instruments: handle, contacts, loads and inertia, which should be nothing
    std::uint64_t solid_touches = 0; // places where solid bodies' surfaces touch
    double deepest_touch_m = 0.0;    // of the deepest of them
    double deepest_share = 0.0;      // the most that one has, of the thinner body's thickness (of a body with itself: 0)
    std::uint64_t held_pairs = 0;    // sphere pairs of solid bodies that push or hold for want of a surface's depth
    std::uint64_t left_pairs = 0;    // pairs of solids, and of leaves of theirs, whose surfaces the budget left: held by their spheres
    std::uint64_t carried_places = 0; // places that pressed there, of solids, or have planes, of instruments, and go on with what was found before
    unsigned carried_instruments = 0; // that ended at their predicted positions: no time to find the walls' planes at all places and to solve between them
    std::uint64_t probe_tests = 0;   // closest-point queries that stood in for sphere pairs which the budget left open
    std::uint64_t passed_places = 0; // vertices beyond the middle of a solid body, or through it: pushed back to where they came from
    /// Pairs of solid bodies that moved so far in the step that one may have passed the other unseen, or that came near and do not touch
    /// since one began inside the other (SceneModel::nested).
    unsigned unproven_solids = 0;
    std::uint64_t softened = 0;      // always 0: no springs push between solids
    double residual_n = 0.0;         // always 0: both bodies feel the same impulses
    double solid_force_n = 0.0;       // sum of the normal forces at places where solid bodies touch, mean over the step
    double max_solid_force_n = 0.0;   // of one of them
    unsigned raised_bodies = 0;       // that took more sub-steps than time.substeps asks for
    unsigned explicit_bodies = 0;     // whose implicit step did not converge: explicit sub-steps took its place
    unsigned contact_iterations = 0;  // of the solver of solids' contact, all sub-steps together
    unsigned contact_unconverged = 0; // sub-steps whose solve ended at its bound: conservative, both bodies feel what there is
    double contact_residual_n = 0.0;  // what the worst place of a solve still wanted to change
    double pull_force_n = 0.0;       // of the user input that pulls a point of a surface
    double packing_density = -1.0;   // [-] share of the scene's ball that instruments fill; negative: none is named
    double target_distance_m = -1.0; // tip to the followed target; negative: none
    std::uint32_t lumen_exits = 0;   // instrument vertices outside the lumen at the end, by an independent test
    bool budget_kept = true;
    bool below_floor = false; // the budget was overrun by what nothing interrupts: all that it may leave out was left out
    std::uint64_t work_units = 0;
    unsigned dropped = 0; // effects left out of this step so that the rest fits, a bit per Droppable

    // stop
    bool finite = true;
    std::string failure; // body, element and number; empty while finite
};

} // namespace trocar::engine
