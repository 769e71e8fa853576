// Stages 1 and 5 to 7 for instruments: the hands move, the rod is solved, and its contact with the lumen's wall is found,
// answered and proven.
#pragma once

#include "engine/step/context.hpp"
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
    const std::size_t wire = model.instruments[instrument].wire;
    return {{instrument, wire}, wire == SIZE_MAX ? std::size_t{1} : std::size_t{2}};
}

/// A wire in another instrument's bore: whatever is done to that one is done to it.
[[nodiscard]] inline bool is_coaxial_inner(const SceneModel& model, std::size_t instrument) noexcept {
    return model.instruments[instrument].inside != SIZE_MAX;
}

/// Decides insertion and rotation at the end of the step.
void apply_drive_commands(const SceneModel& model, State& state, StepContext& context);

/// What the rule that follows the instrument's route wants next; it must have one. Moves the rule's memory on.
[[nodiscard]] DriveCommand steer_along_route(const SceneModel& model, std::size_t instrument, State& state, StepContext& context);

/// Solves the rod from the start of the step to its end against the planes in its scratch, and places the skin; with the
/// wire in its bore, where it has one.
void solve_instrument(const SceneModel& model, std::size_t instrument, State& state, StepContext& context);

/// Moves the sphere chain to the candidate motion.
void update_instrument_trees(const SceneModel& model, std::size_t instrument, State& state, StepContext& context);

/// Moves the balls of every instrument's lumen with their wall: what its descent looks at.
void update_lumens(const SceneModel& model, State& state, StepContext& context);

/// Adds the hollow pair of instrument and lumen to the descent.
void add_to_descent(const SceneModel& model, std::size_t instrument, State& state, spheretree::Descent& descent);

/// A wall's surface at both ends of the step; the same twice where it does not move.
[[nodiscard]] collision::SurfaceMotion wall_motion(const SceneModel& model, std::size_t body, const State& state,
                                                   const StepContext& context);

/// Both of a coaxial pair, as below.
void plane_from_walls(const SceneModel& model, std::size_t instrument, State& state, StepContext& context, double reach);

/// Half-spaces around the rod from the wall's triangles, wherever the descent did not prove it free: the response's own view
/// of the wall, needed with and without the exact stage. Seen from where the rod stood at the start of the step, towards
/// the wall where it stands at the end. refit_wall or follow_wall must have been called.
/// reach   m; triangles at most this far beyond the clearance get a plane
void plane_from_wall(const SceneModel& model, std::size_t instrument, State& state, StepContext& context, double reach);

/// The longest way of a place on the rods in this step and that of its wall, together, m: what lies farther away than this was not met.
[[nodiscard]] double longest_approach(const SceneModel& model, std::size_t instrument, const State& state, const StepContext& context);

/// m; how far planes need to reach, by the motion so far; kPlaneReach at most. Where the solve goes farther they are made again.
[[nodiscard]] double suggest_plane_reach(const SceneModel& model, std::size_t instrument, const State& state, const StepContext& context);

/// Planes and the solve against them. Slow motion needs no planes of what is far: they reach as far as the rod's free motion suggests, and
/// where the solve takes it farther than that, both are made again with kPlaneReach.
void solve_between_walls(const SceneModel& model, std::size_t instrument, State& state, StepContext& context, StepBudget& budget);

/// What the exact stage of one instrument came to.
struct ExactOutcome {
    bool finished = false;      // false: the budget ended first, nothing of it may be used
    double safe_fraction = 1.0; // < 1: contacts remain; the motion is free of touching up to this share
};

/// For an instrument and the wire in its bore: planes from the wall, the solve, and continuous tests of the skin; contacts that are left
/// become planes and the rod is solved again, up to kMaxCorrections times; when that does not help, with the hand held
/// where it was: resistance stops it.
/// budget    asked before every solve and before its tests; nullptr: it runs to its end whatever it costs
ExactOutcome find_exact_contacts(const SceneModel& model, std::size_t instrument, State& state, StepContext& context, StepBudget* budget);

/// The hands of a coaxial pair go no further in and do not turn; what they want to draw back, they may: that is the way out of
/// a jam.
void stop_drive(const SceneModel& model, std::size_t instrument, State& state, StepContext& context);

/// Does the rod, where nothing proved it free, stand closer to the wall at the end of the step than its radius?
/// Or the wire in its bore?
[[nodiscard]] bool penetrates_wall(const SceneModel& model, std::size_t instrument, const State& state, StepContext& context);

/// Continuous tests of the skin's motion as it is. Appends to context.exact.
/// distance   m, counts as touching; 0: touching itself
collision::ExactStats test_skin_at(const SceneModel& model, std::size_t instrument, const State& state, StepContext& context,
                                   double distance, WorkBudget& budget);

/// Trees of wall and skin, built before the first step so that no step pays for them. Nothing when the scene has no
/// contacts.
void build_exact_trees(const SceneModel& model, std::size_t instrument, const State& state, StepContext& context);

/// The same at a fraction of the cost, a part in each step: for planes alone, which allow for what the rest has moved since. Same
/// planes, to the bit.
void follow_wall(const SceneModel& model, std::size_t body, const State& state, StepContext& context);

/// Wall bounds of the step that moves the lumen from surface_t0 to its current place.
void refit_wall(const SceneModel& model, std::size_t body, const State& state, StepContext& context);

/// Normal forces of the planes become springs on the coarse nodes that carry the wall.
void push_wall(const SceneModel& model, std::size_t instrument, State& state, StepReport& report);

/// Appends the places where the rod presses on a wall to context.contacts: gap is what is missing of the clearance.
void list_presses(const SceneModel& model, std::size_t instrument, const State& state, StepContext& context);

/// Instrument vertices outside the lumen, counted by an inside test that shares nothing with the contact stages.
[[nodiscard]] std::uint32_t count_lumen_exits(const SceneModel& model, std::size_t instrument, const State& state, StepContext& context);

inline constexpr unsigned kMaxCorrections = 3;
/// Planes per place on the rod at most: a tube closes in from all sides with six.
inline constexpr std::size_t kPlanesPerPlace = 6;
/// m; the hand moves at most this far in one step, or the contact response would not see what lies ahead. 35 mm/s reach it
/// at a step of 29 ms. Shortening is counted (StepReport::hand_limited).
inline constexpr double kDriveReach = 1.0e-3;
/// m, beyond the clearance: a little more than the hand moves in a step at most.
inline constexpr double kPlaneReach = 1.2 * kDriveReach;
/// N per place on the rod: a vessel perforates at about this; more comes from planes that contradict each other in a jam.
inline constexpr double kMaxPress = 2.0;

} // namespace trocar::engine
