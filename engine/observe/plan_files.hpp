// What a plan leaves behind: path.csv, centreline.csv, plan.json, report.html.
#pragma once

#include "engine/observe/plan.hpp"
#include "engine/scene/scene.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace seldinger::engine {

struct PlanRecord {
    const Scene& scene;
    const PreparedScene& prepared;
    std::string target;
    RouteReport route;
    Plan plan;
};

/// path.csv is what `run --path` reads: t, insertion, rotation in the scene's units. centreline.csv: x, y, z, radius of the
/// route at rest, likewise in the scene's units, from the entry to the target.
/// notices  what could not be made (plots without gnuplot)
/// fails    CannotWrite
[[nodiscard]] Result<void> write_plan(const PlanRecord& record, const std::filesystem::path& folder, std::vector<std::string>& notices);

} // namespace seldinger::engine
