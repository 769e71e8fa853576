// Instruments in a step: they are driven, their rods solved, and contact with the wall of their lumen found, answered and proven.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/instrument/instrument_scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// An instrument and the wire in its bore, which are solved and tested together.
struct Coaxial {
    std::array<std::size_t, 2> index;
    std::size_t count;

    [[nodiscard]] const std::size_t* begin() const noexcept { return index.data(); }
    [[nodiscard]] const std::size_t* end() const noexcept { return index.data() + count; }
};
[[nodiscard]] inline Coaxial coaxial(const SceneModel& model, std::size_t instrument) noexcept {
    const std::optional<std::size_t> wire = model.instruments[instrument].wire;
    return {{instrument, wire.value_or(instrument)}, wire ? std::size_t{2} : std::size_t{1}};
}

/// What is solved and tested together in this step: instruments that may meet one another, the first of which stands for all of them, or else an
/// instrument and the wire in its bore.
struct SolvedTogether {
    std::array<std::size_t, fem::kMostTogether> index;
    std::size_t count;

    [[nodiscard]] const std::size_t* begin() const noexcept { return index.data(); }
    [[nodiscard]] const std::size_t* end() const noexcept { return index.data() + count; }
};
[[nodiscard]] inline SolvedTogether solved_with(const SceneModel& model, const RodsScratch& rods, std::size_t instrument) noexcept {
    SolvedTogether all{};
    if (!rods.together.empty() && rods.together.front() == instrument) {
        for (const std::size_t one : rods.together) all.index[all.count++] = one;
        return all;
    }
    for (const std::size_t one : coaxial(model, instrument)) all.index[all.count++] = one;
    return all;
}

/// Does this instrument stand for all that a joint solve takes in this step?
[[nodiscard]] inline bool leads_together(const RodsScratch& rods, std::size_t instrument) noexcept {
    return !rods.together.empty() && rods.together.front() == instrument;
}

/// Is it solved with another one that stands for it?
[[nodiscard]] inline bool is_solved_with_another(const SceneModel& model, const RodsScratch& rods, std::size_t instrument) noexcept {
    if (shares_axis(model.instruments[instrument])) return true;
    for (std::size_t k = 1; k < rods.together.size(); ++k)
        if (rods.together[k] == instrument) return true;
    return false;
}

/// What met in the last step looks ahead together.
void begin_meetings(const SceneModel& model, const EffectSet& live, State& state, RodsScratch& rods, StepReport& report);

/// Which instruments may meet one another in this step, after the look ahead; lists their half-spaces. Nothing without the effect.
void find_meetings(const SceneModel& model, State& state, RodsScratch& rods);

/// Did the last solve keep them apart? Where not there are half-spaces that it lacked.
[[nodiscard]] bool check_meetings(const SceneModel& model, State& state, RodsScratch& rods);

/// [-] of the step's motion as it ends that is proven not to take instruments through one another; 1 without the effect.
[[nodiscard]] double find_met_share(const SceneModel& model, const State& state, RodsScratch& rods);

/// Notes where the instruments are before the step moves them, and puts them back there.
void keep_instruments(const SceneModel& model, State& state, RodsScratch& rods);
void restore_instruments(const SceneModel& model, State& state, const RodsScratch& rods);

/// Decides insertion and rotation at the end of the step.
/// drive   [instrument_count], or empty: what users want, in place of the scripts
void apply_drive_commands(const SceneModel& model, std::span<const std::optional<DriveCommand>> drive, State& state, RodsScratch& rods,
                          StepReport& report);

/// What the rule that follows the instrument's route wants next; it must have one. Moves the rule's memory on.
[[nodiscard]] DriveCommand steer_along_route(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods);

/// What solves this instrument's rod, with the wire in its bore; null: it is such a wire.
/// plane_count   of both, that there is room for
[[nodiscard]] std::unique_ptr<fem::RodSolver> make_solver(const SceneModel& model, std::size_t instrument, std::size_t plane_count);

/// What effects do to the instruments in this step, seen from its start: for all of its solves.
void load_instruments(const SceneModel& model, const EffectSet& live, State& state, RodsScratch& rods, StepReport& report);

/// Solves the rod from the start of the step to its end against the planes in its scratch, and places the skin; with the
/// wire in its bore, where it has one.
/// rough   another solve of this step follows: see RodDrive
void solve_instrument(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, bool rough = false);

/// Moves the sphere chain to the candidate motion.
void update_instrument_trees(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods);

/// Moves the balls of every instrument's lumen with their wall: what its traversal tests.
void update_lumens(const SceneModel& model, State& state, RodsScratch& rods);

/// Adds the hollow pair of instrument and lumen to the descent.
void add_to_descent(const SceneModel& model, std::size_t instrument, State& state, spheretree::Descent& descent);

/// A wall's surface at both ends of the step; the same twice where it does not move.
[[nodiscard]] collision::SurfaceMotion wall_motion(const SceneModel& model, std::size_t body, const State& state,
                                                   const RodsScratch& rods);

/// Of InstrumentScratch::wall_distance: midway along a segment (weight 0.5) and at its end (1).
[[nodiscard]] inline std::size_t slot_of(Index node, double weight) noexcept { return 2 * std::size_t{node} + (weight < 1.0 ? 0 : 1); }

/// The first node whose segment may meet the wall in this step.
[[nodiscard]] Index first_walled_node(const SceneModel& model, std::size_t instrument, const RodsScratch& rods);

/// Has the descent proven that the rod keeps more than the margin from the wall here, all step long?
[[nodiscard]] bool proven_free(const SceneModel& model, std::size_t instrument, Index node, double weight, const RodsScratch& rods);

/// Both of a coaxial pair, as below.
std::size_t plane_from_walls(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, double reach);

/// Half-spaces around the rod from the wall's triangles, wherever the descent did not prove it free: the response's own view
/// of the wall, needed with and without the exact stage. Seen from where the rod stood at the start of the step, towards
/// the wall where it stands at the end. follow_wall must have been called.
/// reach    m; triangles at most this far beyond the clearance get a plane
/// partly   only places that are InstrumentScratch::fresh, seen from where the rod has come to; the others keep the planes that they have
/// Returns how many places it made planes for.
std::size_t plane_from_wall(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, double reach, bool partly = false);

/// Is a place that came farther than `way` in this step, m, beyond its wall now, or deeper in it than `depth`, m? Planes may not have told of what
/// it has met.
[[nodiscard]] bool has_swept_into_wall(const SceneModel& model, std::size_t instrument, double way, double depth, const State& state, RodsScratch& rods);

/// The longest way of a place on the rods in this step and that of its wall, together, m: what lies farther away than this was not met.
[[nodiscard]] double longest_approach(const SceneModel& model, std::size_t instrument, const State& state, const RodsScratch& rods);

/// Did the last solve, in any of its iterations, take a place farther than planes of this reach tell of? A plane that it lacked may have
/// pressed there: with all of them it comes to the same place by another way, which differs in the last bits.
[[nodiscard]] bool solve_left_reach(const SceneModel& model, std::size_t instrument, double reach, const State& state, const RodsScratch& rods);

/// m; kPlaneReach, and the way that the wall itself comes.
[[nodiscard]] double farthest_reach(const SceneModel& model, std::size_t instrument, const RodsScratch& rods);

/// m; how far planes need to reach, by the motion so far; farthest_reach at most. Where the solve goes farther they are made again.
[[nodiscard]] double suggest_plane_reach(const SceneModel& model, std::size_t instrument, const State& state, const RodsScratch& rods);

/// A solve against planes of the whole reach that took the rod farther than they tell of (a bent tip that springs out of its port, a tip that
/// snaps free) is made again in a thicker fluid, until it stays within them.
void keep_within_reach(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods);

/// Planes and the solve against them. Slow motion needs no planes of what is far: they reach as far as the rod's free motion suggests, and
/// where the solve takes it farther than that, if only in one of its iterations, both are made again as far as the drive and
/// the wall may come: what all planes come to from the start, to the tolerance of the solve (1e-9 m; a test).
void solve_between_walls(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, StepBudget& budget);

/// A rod that slid along its wall has come to triangles that were beside those of its planes: planes of where it stands now, added to the
/// others, and the solve once more.
void solve_where_it_stands(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, StepBudget& budget);

/// What the exact stage of one instrument came to.
struct ExactOutcome {
    bool finished = false;      // false: the budget ended first, nothing of it may be used
    double safe_fraction = 1.0; // < 1: contacts remain; the motion is free of touching up to this share
    std::uint64_t unresolved = 0; // tests of the last round that ended without a verdict
};

/// For an instrument and the wire in its bore: planes from the wall, the solve, and continuous tests of the skin; contacts that are left
/// become planes and the rod is solved again, up to kMaxCorrections times; when that does not help, with the drive held
/// where it was: resistance stops it.
/// budget    asked before every solve and before its tests; nullptr: it runs to its end whatever it costs
ExactOutcome find_exact_contacts(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, StepReport& report,
                                 StepBudget* budget);

/// The drives of a coaxial pair go no further in and do not turn; what they are told to draw back, they may: that is the way out of
/// a jam.
void stop_drive(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods);

/// Does the rod, where nothing proved it free, stand closer to the wall at the end of the step than its radius?
/// Or the wire in its bore?
[[nodiscard]] bool penetrates_wall(const SceneModel& model, std::size_t instrument, const State& state, RodsScratch& rods);

/// Continuous tests of the skin's motion as it is. Appends to rods.hits.
/// distance   m, counts as touching; 0: touching itself
collision::ExactStats test_skin_at(const SceneModel& model, std::size_t instrument, const State& state, RodsScratch& rods,
                                   double distance, WorkBudget& budget);

/// Trees of wall and skin, built before the first step so that no step pays for them. Nothing when the scene has no
/// contacts.
void build_exact_trees(const SceneModel& model, std::size_t instrument, const State& state, RodsScratch& rods);

/// The tree of a wall goes on to this step's motion, once a step: cheap, however large the wall, since bounds are made anew where a
/// search asks for them. Of a step that does not follow the last one everything is.
/// budget   nullptr: nothing is charged
void follow_wall(const SceneModel& model, std::size_t body, const State& state, RodsScratch& rods, StepBudget* budget = nullptr);

/// The same of the walls of all that is solved with it.
void follow_walls(const SceneModel& model, std::size_t instrument, const State& state, RodsScratch& rods, StepBudget* budget = nullptr);

/// What the exact stage of an instrument, and of the wire in its bore, is expected to do: the numbers of its last run.
[[nodiscard]] ExactForecast forecast_exact(const SceneModel& model, std::size_t instrument, const State& state, const RodsScratch& rods) noexcept;

/// Adds the planes' forces.
void report_presses(std::size_t instrument, const State& state, StepReport& report);

/// Handle's force and torque, and what is missing of the rods' balance.
void report_rods(const SceneModel& model, const State& state, const RodsScratch& rods, StepReport& report);

/// Appends the places where the rod presses on a wall: gap is what is missing of the clearance.
/// origin   of what is appended: how the motion was tested
void list_presses(const SceneModel& model, std::size_t instrument, const State& state, ContactOrigin origin, std::vector<Contact>& contacts);

/// The same of the places where the rod presses on itself: both things are the instrument, features are its nodes.
void list_self_presses(const SceneModel& model, std::size_t instrument, const State& state, ContactOrigin origin,
                       std::vector<Contact>& contacts);

/// The same of all places where instruments press on one another: features are their nodes.
void list_meetings(const SceneModel& model, const State& state, ContactOrigin origin, std::vector<Contact>& contacts);

/// Instrument vertices outside the lumen, counted by an inside test that shares nothing with the contact stages.
[[nodiscard]] std::uint32_t count_lumen_exits(const SceneModel& model, std::size_t instrument, const State& state, RodsScratch& rods);

inline constexpr unsigned kMaxCorrections = 3;
/// Planes per place on the rod at most: a tube closes in from all sides with six, a place may lie in a corner of its facets, and tissue folds up
/// around what presses into it.
inline constexpr std::size_t kPlanesPerPlace = 24;
/// m; the drive moves at most this far in one step, or the contact response would not see what lies ahead. 35 mm/s reach it
/// at a step of 29 ms. Shortening is counted (StepReport::drive_limited).
inline constexpr double kDriveReach = 1.0e-3;
/// m, beyond the clearance: a little more than the drive moves in a step at most.
inline constexpr double kPlaneReach = 1.2 * kDriveReach;

} // namespace trocar::engine
