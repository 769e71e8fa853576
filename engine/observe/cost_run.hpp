// The price of accuracy: one scene under several budgets, measured against the same scene with no limit.
//
// Two questions, two ways to ask. Along the exact run's states: what would this budget have answered in each step? That is
// where contacts, depths and forces are compared, since both answers look at the same instant. And run by itself: where does
// the scene end up, and how long do its steps take?
#pragma once

#include "engine/observe/observer.hpp"
#include "engine/observe/patches.hpp"
#include "engine/observe/surface_distance.hpp"

#include <functional>

namespace seldinger::engine {

struct NamedBudget {
    std::string name; // as it was written
    BudgetLimits limits;
};

struct CostOptions {
    std::vector<NamedBudget> budgets;
    std::uint64_t steps = 0;
    std::function<void(const std::string&)> progress = [](const std::string&) {};
    std::function<bool()> interrupted = [] { return false; };
};

/// A quantity over the run: at most kCurvePoints points, evenly spread.
inline constexpr std::size_t kCurvePoints = 400;
struct CostPoint {
    double time_s = 0.0;
    double level = 0.0;          // coarsest level reached since the point before
    double pairs_open = 0.0;     // most since the point before
    double tip_distance_m = 0.0; // farthest from the exact run's since the point before
    double step_ms = 0.0;        // slowest since the point before
};

struct CostRow {
    NamedBudget budget;
    std::uint64_t steps = 0; // taken; fewer than asked for where a run was stopped
    std::string failure;     // why it was stopped
    // run by itself
    Percentiles step_ms, charged_ms;
    double step_ms_p999 = 0.0;
    double budget_kept = 1.0; // share of steps
    std::uint64_t exact_steps = 0, lumen_exits = 0, dropped_steps = 0;
    SurfaceDistance surface; // against the exact run, over the compared steps
    double tip_distance_rms_m = 0.0, tip_distance_max_m = 0.0;
    std::string state_hash;
    std::vector<CostPoint> curve;
    // along the exact run's states
    double pairs_open_mean = 0.0, leaf_contacts_mean = 0.0, level_reached_mean = 0.0, assumed_mean = 0.0;
    PatchDifference contacts;
    double force_error_rel = 0.0; // root of the summed squared differences of the contact forces over that of the exact ones
    [[nodiscard]] double depth_error_rms_m() const noexcept;
};

struct CostTable {
    std::vector<CostRow> rows;         // as the budgets
    std::uint64_t steps = 0;           // of the exact run
    std::uint64_t compared_states = 0; // at which surfaces were compared
    double tolerance_m = 0.0;
    std::vector<double> patch_m;      // by body
    std::uint64_t near_patches = 0;   // (patch, step) of solids nearer than the tolerance, by the independent search
    std::uint64_t near_uncovered = 0; // of those, beneath no leaf pair that the exact descent reported
    double near_depth_rms_m = 0.0;    // over the covered ones: depth of the leaf spheres against that of the surfaces
    double force_rms_n = 0.0;         // of the exact run, over steps and bodies
    bool interrupted = false;
    std::vector<std::string> notices;
};

/// Exact run, then every budget by itself, then all budgets along the exact run's states: some 2 + 1 per budget times the
/// scene's cost.
[[nodiscard]] CostTable measure_cost(const PreparedScene& prepared, const CostSpec& cost, const CostOptions& options);

} // namespace seldinger::engine
