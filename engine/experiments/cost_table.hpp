// The table of costs: what is asked for, and what a row holds (cost_run.hpp measures it).
#pragma once

#include "base/result.hpp"
#include "engine/experiments/patches.hpp"
#include "engine/experiments/surface_distance.hpp"
#include "engine/report/run_summary.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace trocar::engine {

struct NamedBudget {
    std::string name; // as it was written
    BudgetLimits limits;
};

/// The same scene answered another way (cost_variants.hpp): every budget is measured with it as well.
struct CostVariant {
    std::string name;
    const SceneModel* model = nullptr; // same bodies and instruments as the scene's; outlives the measurement
};

/// A quantity over the run: at most kCurvePoints points, evenly spread.
inline constexpr std::size_t kCurvePoints = 400;
struct CostPoint {
    double time_s = 0.0;
    double level = 0.0;          // coarsest level reached since the point before
    double pairs_open = 0.0;     // most since the point before
    double tip_distance_m = 0.0; // farthest from the exact run's since the point before
    double step_ms = 0.0;        // whole step, slowest since the point before
    double charged_ms = 0.0;     // what the budget's scope took of a step, slowest since the point before
};

/// What a run by itself came to.
struct CostOwnRun {
    std::uint64_t steps = 0; // taken; fewer than asked for where a run was stopped
    std::string failure;     // why it was stopped
    Percentiles step_ms, charged_ms;
    double budget_kept = 1.0, realtime_kept = 1.0; // shares of steps: of their budgeted part, and of the whole
    std::uint64_t exact_steps = 0, lumen_exits = 0, dropped_steps = 0;
    SurfaceDistance trajectory; // surfaces against the exact run's, over the compared steps
    double tip_distance_rms_m = 0.0, tip_distance_max_m = 0.0;
    std::string state_hash;
    std::vector<CostPoint> curve;
};

/// What was answered along the exact run's states.
struct CostAlong {
    double pairs_open_mean = 0.0, leaf_contacts_mean = 0.0, level_reached_mean = 0.0, assumed_mean = 0.0;
    PatchDifference contacts;
    /// (patch, step) that the exact answer or any row's takes for a contact. Errors of depth are over these: over the patches of one
    /// answer alone a budget that drops false contacts, all shallow, would look worse for it.
    std::uint64_t depth_patches = 0;
    double force_error_rel = 0.0; // root of the summed squared differences of the contact forces over that of the exact ones
    SurfaceDistance surface;      // where the answer takes the surfaces, over the compared steps; see LookAhead
    [[nodiscard]] double depth_error_rms_m() const noexcept;
};

struct CostRow : CostOwnRun, CostAlong {
    NamedBudget budget;
    std::string variant; // empty: as the scene says
    /// Budget and variant, for people.
    [[nodiscard]] std::string name() const { return variant.empty() ? budget.name : budget.name + " " + variant; }
};

class CostParts;

struct CostOptions {
    std::vector<NamedBudget> budgets;
    std::vector<CostVariant> variants;
    std::uint64_t steps = 0;
    std::uint64_t from = 0;       // steps of the exact run before the first of them
    const State* start = nullptr; // the exact run's state there, which whoever measures finds; null: the scene's start
    std::function<void(const std::string&)> progress = [](const std::string&) {};
    std::function<bool()> interrupted = [] { return false; };
    CostParts* parts = nullptr; // what was finished before is taken from here, and what is finished is kept there; null: nowhere
    /// Runs by themselves are measured by somebody else meanwhile: gives the row's, when it is done. Empty: measured here.
    std::function<Result<CostOwnRun>(std::size_t row)> elsewhere;
    /// Called for every row in the step of the exact run that looked at most pairs of spheres.
    std::function<void(const CostRow& row, Simulator& answer)> show;
};

struct CostTable {
    std::vector<CostRow> rows;         // as the budgets; then, for every variant, again
    std::uint64_t model_hash = 0;      // hash_model of the scene, as it was prepared
    std::uint64_t steps = 0;           // of the exact run
    std::uint64_t from = 0;            // that it had taken before
    std::uint64_t compared_states = 0; // at which surfaces were compared
    double tolerance_m = 0.0;
    std::vector<double> patch_m;                 // by body
    std::uint64_t near_patches = 0;              // (patch, step) of solids nearer than the tolerance, by the independent search
    std::uint64_t near_uncovered = 0;            // of those, beneath no leaf pair that the exact descent reported
    double near_depth_rms_m = 0.0;               // over the covered ones: depth of the leaf spheres against that of the surfaces
    double floor_ms = -1.0;                      // charged under a budget of nothing where the exact run touched most; negative: not measured
    double force_rms_n = 0.0;                    // of the exact run, over steps and bodies
    [[nodiscard]] bool touched() const noexcept; // anything at all, in the exact run
    bool interrupted = false;
    std::vector<std::string> notices;
};

} // namespace trocar::engine
