// States for ParaView: every surface, every coarse mesh, as one time series.
#pragma once

#include "engine/io/write_mesh.hpp"
#include "engine/state/state.hpp"

#include <filesystem>

namespace trocar::engine {

/// Writes the surfaces, instrument skins and axes (VTP, these with tension, bending moment, torque and contact forces) and coarse meshes
/// (VTU, with velocities and volume ratios) of one state.
/// only_moving  bodies that never move are left out
/// returns      the files' names, part by part
[[nodiscard]] Result<std::vector<std::string>> write_state(const std::filesystem::path& folder, const SceneModel& model, const State& state,
                                                           const std::string& suffix, bool only_moving);

class Recorder {
public:
    /// every  steps between states; 0: nothing is recorded
    Recorder(const SceneModel& model, std::filesystem::path folder, std::uint64_t every);

    /// Makes the folder and writes the state before the first step.
    [[nodiscard]] Result<void> start(const State& state);
    /// Writes the state if it is due.
    [[nodiscard]] Result<void> after_step(const State& state);
    /// Writes the last state, if it is not there, and the collection.
    [[nodiscard]] Result<void> finish(const State& state);

private:
    [[nodiscard]] Result<void> add(const State& state);

    const SceneModel& model_;
    std::filesystem::path folder_;
    std::uint64_t every_;
    std::uint64_t last_step_ = 0;
    std::uint64_t count_ = 0;
    PvdCollection collection_;
    std::vector<std::string> still_; // files of bodies that never move
};

} // namespace trocar::engine
