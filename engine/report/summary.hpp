// summary.json: the run in one machine-readable page, with the keys that scripts rely on first.
#pragma once

#include "engine/prepare/prepared_scene.hpp"
#include "engine/report/output_keys.hpp"
#include "engine/report/places.hpp"
#include "engine/report/statistics.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

class XrayFrames;

/// Facts about a finished run, beside its statistics.
struct RunRecord {
    const Scene& scene;
    const PreparedScene& prepared;
    RunStatistics& statistics; // its series are sorted on the way
    RunSummary summary = {};   // filled by make_run_summary
    std::array<double, kStageCount> stage_p50{};
    double observe_s = 0.0; // wall time of pictures and records, not part of wall_s
    bool interrupted = false;
    std::uint64_t resumed_step = 0;         // steps that an earlier run had done; 0: none
    std::uint64_t checkpoint_step = 0;      // of the newest checkpoint; 0: none was written
    std::uint64_t failed_step = 0;          // 0: none
    std::string last_good_state = {};       // folder, empty: the run was not stopped
    std::vector<std::string> pictures = {}; // file names
    std::string gl = {};                    // who drew them
    std::vector<std::string> notices = {};
    Machine machine = {};
    const XrayFrames* xrays = nullptr; // none were asked for
};

/// Fills summary and stage_p50 from the statistics.
/// wall_s   of the steps and what is between them, without observation
void make_run_summary(RunRecord& record, double simulated_s, double wall_s, std::uint64_t state_hash);

/// JSON, keys in the order that scripts rely on. Numbers that are not finite become null, as JSON has none.
[[nodiscard]] std::string summary_text(const RunRecord& record);

/// Its keys.
[[nodiscard]] std::vector<OutputTable> summary_tables();

} // namespace trocar::engine
