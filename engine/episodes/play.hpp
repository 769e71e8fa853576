// One episode of a task, played by a policy: its figures (summary.json), a row for each action (actions.csv), and what makes them a record.
#pragma once

#include "engine/episodes/environment.hpp"
#include "engine/episodes/record.hpp"
#include "engine/report/output_keys.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace trocar::engine {

struct PlayedEpisode {
    std::string scene, target, policy;
    std::uint64_t seed = 0;
    std::string budget;
    std::uint64_t actions = 0, action_limit = 0, steps = 0;
    double seconds = 0.0;        // simulated
    double reward = 0.0;         // sum
    std::array<double, kRewardTerms> terms{}; // likewise
    bool success = false;        // the target was reached
    double remaining = 0.0, distance = 0.0; // m, at the end
    double closest = 0.0;        // m, least distance, the start included
    double force = 0.0;          // N, largest
    std::uint64_t exits = 0, unresolved = 0, assumed = 0, overruns = 0, exact_steps = 0;
    std::uint64_t state_hash = 0; // at the end
    std::string failure;         // of the simulation; empty: none
    std::string table;           // actions.csv
    bool interrupted = false;
};

/// policy    its text, as make_policy takes it
/// progress  called before each action with what is done
/// fails     as make_policy, Policy::act and Environment::reset
[[nodiscard]] Result<PlayedEpisode> play_episode(const std::shared_ptr<const Task>& task, std::uint64_t seed, const std::string& policy, const Progress& progress);

/// All files, complete.
[[nodiscard]] Result<void> write_episode(const PlayedEpisode& episode, const Task& task, const EpisodeSource& source,
                                         const std::filesystem::path& folder);

/// Keys and columns of summary.json and actions.csv.
[[nodiscard]] std::vector<OutputTable> episode_output_tables();

} // namespace trocar::engine
