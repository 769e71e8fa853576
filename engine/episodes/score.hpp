// An episode that was written down (record.hpp), simulated again and judged. An edited byte is found: of a file by its hash, of the course
// by simulating it again.
#pragma once

#include "engine/episodes/task.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace trocar::engine {

struct EpisodeScore {
    std::string scene, target, program; // program: hash of the one that wrote the episode
    std::uint64_t actions = 0;
    bool success = false;         // the target was reached
    bool safe = false;            // and no vertex left the lumen, no force was above the limit, nothing failed
    double peak_force_n = 0.0;
    double remaining_m = 0.0;     // to the target along the centreline, at the end
    double reward = 0.0;          // sum
    std::uint64_t exits = 0, unresolved = 0, assumed = 0, overruns = 0;
    std::string failure;          // of the simulation; empty: none
    std::uint64_t state_hash = 0; // at the end
};

/// Simulates the episode of a folder again.
/// force_limit  N, of a safe success
/// scene        in place of the file that the manifest names; empty: that file
/// differs      set where the episode is not what was simulated: the error then says where
/// fails        FileNotFound, BadSyntax: an incomplete or edited folder; BadValue: another scene, or another course
[[nodiscard]] Result<EpisodeScore> score_episode(const std::filesystem::path& folder, double force_limit, const std::filesystem::path& scene,
                                                 bool& differs, const Progress& progress = {});

} // namespace trocar::engine
