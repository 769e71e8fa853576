// All that changes from step to step and decides what comes next. Hashing it tells whether two runs are the same run.
#pragma once

#include "engine/prepare/model.hpp"
#include "engine/step/script.hpp"

#include <cstdint>

namespace trocar::engine {

struct BodyState {
    fem::TissueState tissue;   // deformable bodies
    std::vector<Vec3> surface; // [vertex_count] m, at the end of the last step
};

struct InstrumentState {
    fem::RodState rod;
    std::vector<Vec3> skin; // [skin vertex_count] m, at the end of the last step
    FollowState follow;
};

struct State {
    std::uint64_t step = 0;        // steps done
    double time = 0.0;             // s
    std::vector<BodyState> bodies; // as SceneModel::bodies
    std::vector<InstrumentState> instruments;
};

[[nodiscard]] State make_initial_state(const SceneModel& model);

/// 64-bit FNV-1a over the bits of step, positions, velocities, insertions and rotations, in the order of the structs.
[[nodiscard]] std::uint64_t hash_state(const State& state) noexcept;

} // namespace trocar::engine
