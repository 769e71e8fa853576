// An episode as it is written down, for `score` to simulate again.
//
// Its folder: manifest.json (scene, options, seed, budget, hashes of the model and of the other files), manifest.hash, and actions.csv: a
// row for each action, with the drive commands and the hash of the state after it; what else a row has is not read. `trocar episode` and
// Navigation.record of the Python package write one.
#pragma once

#include "engine/episodes/task.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace trocar::engine {

namespace episode_record {
inline constexpr const char* kKind = "trocar-episode";
inline constexpr int kVersion = 1;
/// Columns of actions.csv: NAME.insertion_mm_s and NAME.rotation_rad_s of each instrument, and the state.
inline constexpr const char* kInsertion = ".insertion_mm_s";
inline constexpr const char* kRotation = ".rotation_rad_s";
inline constexpr const char* kState = "state";
} // namespace episode_record

/// What an episode's scene was read from.
struct EpisodeSource {
    std::filesystem::path scene;       // file
    std::string text;                  // its content, where that is no file; empty: it is
    std::vector<std::string> settings; // POINTER=VALUE, in place of what the file says
    std::optional<std::uint32_t> anatomy_seed;
};

/// The columns' names, with commas between.
[[nodiscard]] std::string record_columns(const SceneModel& model);
/// The same columns of one action.
/// action  [devices][2] mm/s and rad/s
[[nodiscard]] std::string record_cells(std::span<const double> action, std::uint64_t state_hash);

/// An episode whose budget is a time is not simulated again: how far a step gets depends on the machine.
[[nodiscard]] bool can_be_recorded(const Task& task) noexcept;

/// manifest.json and manifest.hash, after the files that they vouch for.
/// files   names in the folder
/// fails   CannotWrite, FileNotFound
[[nodiscard]] Result<void> write_manifest(const Task& task, const EpisodeSource& source, std::uint64_t seed,
                                          std::span<const std::string> files, const std::filesystem::path& folder);

/// 16 hexadecimal digits, as a record has hashes.
[[nodiscard]] std::string hash_text(std::uint64_t hash);
/// The hash that an episode's files are known by.
[[nodiscard]] std::string hash_file_bytes(std::string_view bytes);

} // namespace trocar::engine
