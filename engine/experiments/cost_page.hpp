// Outputs of `cost`: a table for scripts, one for readers, and a page with plots.
#pragma once

#include "engine/experiments/cost_pictures.hpp"
#include "engine/experiments/cost_run.hpp"
#include "engine/report/output_keys.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// The contract's columns, a row per budget, and with variants one more column that names them; every number with the digits that tell
/// it from its neighbours.
[[nodiscard]] std::string cost_csv(const CostTable& table);

/// Everything that was measured, as JSON.
[[nodiscard]] std::string cost_json(const Scene& scene, const CostTable& table);

/// Columns and keys of both.
[[nodiscard]] std::vector<OutputTable> cost_output_tables();

/// The command that repeats a measurement.
[[nodiscard]] std::string cost_command_text(const Scene& scene, const CostTable& table);

/// The table for a terminal.
[[nodiscard]] std::string cost_text(const CostTable& table);

/// Figures of the page, in HTML. Without gnuplot, or with nothing to draw, none; the former is a notice of the table.
[[nodiscard]] std::string cost_plots(const Scene& scene, CostTable& table);

/// One page without any other file. Without gnuplot a notice stands in place of the plots.
[[nodiscard]] std::string cost_page(const Scene& scene, CostTable& table, std::span<const CostPicture> pictures = {});

} // namespace trocar::engine
