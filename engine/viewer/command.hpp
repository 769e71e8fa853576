// Commands of the page, as plain data: it crosses from the network's thread to the simulation's without
// allocating. read_command.hpp makes it out of a message.
#pragma once

#include "base/vec.hpp"
#include "engine/scene/effect.hpp"
#include "engine/time/step_budget.hpp"

#include <array>
#include <cstdint>
#include <variant>

namespace trocar::engine::viewer {

/// Drive command: speeds as shares of the instrument's limits, until the next such command.
struct Drive {
    double insertion = 0.0; // [-1, 1]
    double rotation = 0.0;  // [-1, 1]
};
/// Drive command to a place: as fast as the limits allow, and then it stays there. A drive command of speeds ends it.
struct DriveTo {
    double insertion = 0.0; // m beyond the port
    double rotation = 0.0;  // rad of the handle
};
/// The scene's own script drives, or gives control back to the user.
struct FollowScript {
    bool on = false;
};
struct SetBudget {
    BudgetLimits limits;
};
struct Pause {
    bool on = false;
};
struct SingleStep {}; // while paused
/// Simulated seconds per second, at most.
struct Pace {
    double factor = 1.0; // [kSlowestPace, 1]
};
struct SwitchEffect {
    const EffectDescriptor* effect = nullptr;
    bool on = true;
};
/// Holds a vertex of a body's surface and pulls it to a place; the same again moves the place.
struct Grab {
    std::uint32_t body = 0, vertex = 0; // both exist: checked when the message was read
    Vec3 target = Vec3::Zero();         // m
};
struct LetGo {};
/// Contrast agent, as the scene's effect says, from now on.
struct Inject {};
struct Restart {};
/// UTF-8, ended by a 0.
inline constexpr std::size_t kLongestStateName = 48; // bytes
using StateName = std::array<char, kLongestStateName + 1>;
/// The state as it stands is kept under a name, in place of what has that name already.
struct SaveState {
    StateName name{};
};
/// Back to a state that was saved; to none where there is no such one.
struct RestoreState {
    std::uint32_t saved = 0; // SavedMark::id
};
struct ForgetState {
    std::uint32_t saved = 0;
};
/// Asks for the recording and the hash of the state as it stands, or for a saved state, which are taken away.
struct Seal {
    std::uint32_t saved = 0; // 0: none
};

using Command = std::variant<Drive, DriveTo, FollowScript, SetBudget, Pause, SingleStep, Pace, SwitchEffect, Grab, LetGo, Inject, Restart, SaveState,
                             RestoreState, ForgetState, Seal>;

inline constexpr double kSlowestPace = 0.05;
/// s per step: the range of the budget that a person may set.
inline constexpr double kLeastBudget = 0.1e-3, kMostBudget = 33e-3;
/// Work units per step, likewise: the main scene's descent costs some ten thousand, its exact stage a million.
inline constexpr std::uint64_t kLeastWork = 10, kMostWork = 100'000'000;

} // namespace trocar::engine::viewer
