#include "engine/report/episode_table.hpp"

namespace trocar::engine {

std::vector<OutputKey> action_table_columns() {
    return {{"action", "", "Number of the action; the first one is 1."},
            {"time_s", "s", "Simulated time of the episode at the end of the action."},
            {"reward", "", "Of this action."},
            {"remaining_m", "m", "From the tip to the target, along the centreline."},
            {"distance_m", "m", "From the tip to the target, in a straight line."},
            {"contact_force_n", "N", "Largest normal force at one place on a wall during the action."},
            {"lumen_exits", "", "Instrument vertices outside the lumen, summed over the action's steps."},
            {"unresolved", "", "Continuous tests that ended without a verdict, likewise."},
            {"exact_steps", "", "Steps of the action whose answer the exact stage gave."},
            {"overruns", "", "Steps of the action that missed their budget."}};
}

std::string action_table_header() {
    std::string header;
    for (const OutputKey& column : action_table_columns()) header += (header.empty() ? "" : ",") + std::string(column.name);
    return header;
}

} // namespace trocar::engine
