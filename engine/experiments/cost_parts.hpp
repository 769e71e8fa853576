// What of a table of costs is finished, as files: an interrupted measurement goes on from there, and several processes share it.
#pragma once

#include "engine/experiments/cost_exact.hpp"

#include <filesystem>
#include <optional>

namespace trocar::engine {

class CostParts {
public:
    /// folder  made when something is kept
    /// key     what the parts belong to: scene, budgets, variants, steps (key_of); parts of another key are not there
    CostParts(std::filesystem::path folder, std::uint64_t key) : folder_(std::move(folder)), key_(key) {}

    [[nodiscard]] static std::uint64_t key_of(const SceneModel& model, const CostOptions& options);

    /// Nothing where it is not there, of another key, or damaged.
    [[nodiscard]] std::optional<State> start(const SceneModel& model) const; // of CostOptions::from
    [[nodiscard]] std::optional<ExactRun> exact_run() const;
    [[nodiscard]] std::optional<CostOwnRun> own_run(std::size_t row) const;
    /// fails  CannotWrite
    [[nodiscard]] Result<void> keep_start(const State& state) const;
    [[nodiscard]] Result<void> keep(const ExactRun& run) const;
    [[nodiscard]] Result<void> keep(std::size_t row, const CostOwnRun& run) const;
    /// How many parts of this key are there.
    [[nodiscard]] std::size_t count(std::size_t rows) const;
    /// From the start on: what is interrupted is known by it.
    [[nodiscard]] Result<void> make_folder() const;
    /// Removes the folder and the parts in it; other files are left alone.
    void remove(std::size_t rows) const;

private:
    [[nodiscard]] std::filesystem::path start_file() const { return folder_ / "start.bin"; }
    [[nodiscard]] std::filesystem::path exact_file() const { return folder_ / "exact.bin"; }
    [[nodiscard]] std::filesystem::path row_file(std::size_t row) const;
    std::filesystem::path folder_;
    std::uint64_t key_;
};

} // namespace trocar::engine
