// Outputs of a plan: path.csv, centreline.csv, plan.json, report.html.
#pragma once

#include "engine/experiments/plan.hpp"
#include "engine/report/output_keys.hpp"
#include "engine/scene/scene.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

struct PlanRecord {
    const Scene& scene;
    const PreparedScene& prepared;
    std::string target;
    RouteReport route;
    Plan plan;
    Replay replay; // of a plan that arrived
};

/// Keys of plan.json.
[[nodiscard]] std::vector<OutputTable> plan_output_tables();

/// The plan's rows as `run --path` reads them back: out of the scene's units and into them again.
[[nodiscard]] std::vector<DriveRow> rows_as_written(const PlanRecord& record);

/// The command that follows the path to the end of the scene, or of the path where that is longer.
[[nodiscard]] std::string replay_command(const PlanRecord& record, const std::string& path);

/// path.csv is what `run --path` reads: t, insertion, rotation in the scene's units. centreline.csv: x, y, z, radius of the
/// route at rest, likewise in the scene's units, from the entry to the target.
/// notices  what could not be made (plots without gnuplot)
/// returns  what came of each file: CannotWrite of one does not keep the others from being written
[[nodiscard]] std::vector<Result<void>> write_plan(const PlanRecord& record, const std::filesystem::path& folder,
                                                   std::vector<std::string>& notices, bool page = true);

} // namespace trocar::engine
