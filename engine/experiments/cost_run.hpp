// The price of accuracy: one scene under several budgets, measured against the same scene with no limit.
//
// Two questions, two ways to ask. Along the exact run's states: what would this budget have answered in each step? That is
// where contacts, depths, forces and what they do to the surfaces are compared, since both answers begin from the same state. And run
// by itself: how far does its trajectory diverge from the exact run's, and how long do its steps take? Errors of a step are no part of
// the second: where trajectories have parted, a larger budget may well lie farther away.
#pragma once

#include "base/result.hpp"
#include "engine/experiments/cost_table.hpp"
#include "engine/prepare/prepare_scene.hpp"

#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

/// Exact run as the scene says, then every row's run by itself, then all rows along the exact run's states: some 2 + 2 per row times
/// the scene's cost.
/// fails     where options.elsewhere fails; parts that cannot be kept are a notice
[[nodiscard]] Result<CostTable> measure_cost(const PreparedScene& prepared, const CostSpec& cost, const CostOptions& options);

/// The run of one row by itself, as another process measures it for that table: from the parts, and into them.
[[nodiscard]] Result<void> measure_own_run(const PreparedScene& prepared, const CostOptions& options, std::size_t row);

/// The exact run alone, into the parts.
[[nodiscard]] Result<void> measure_exact_run(const PreparedScene& prepared, const CostOptions& options);

/// CostOptions::from and steps.
struct CostStretch {
    std::uint64_t from = 0, steps = 0;
};
/// from_s   s
/// steps    nothing: to the scene's end, at most `usual`
/// fails    BadValue: no such time; or at the scene's end or beyond, where no number of steps is asked for
[[nodiscard]] Result<CostStretch> choose_stretch(const SceneModel& model, double from_s, std::optional<std::uint64_t> steps, std::uint64_t usual);

/// " from 15 s", where the compared stretch does not begin with the scene.
[[nodiscard]] std::string start_text(const CostTable& table, double step_s);

/// Rows of that table, nothing measured yet.
[[nodiscard]] std::vector<CostRow> list_rows(const CostOptions& options);

} // namespace trocar::engine
