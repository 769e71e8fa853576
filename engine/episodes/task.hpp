// Navigation as a task: an instrument is to bring its tip to a target of its lumen. What episodes of one scene share, found once.
#pragma once

#include "engine/prepare/prepare_scene.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"
#include "spheretree/lumen/centreline.hpp"

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trocar::engine {

/// Terms of the reward, each the product of its weight and what it measures.
enum class RewardTerm : std::uint8_t {
    Advance, // m that the way to the target along the centreline has become shorter
    Target,   // 1 when the target is reached
    Force,    // N, largest normal force at one place on a wall
    Step,     // 1 for each action
};
inline constexpr std::size_t kRewardTerms = 4;

/// In a metre: actions, observations and their bounds are in mm.
inline constexpr double kMillimetre = 1e3;

struct TaskOptions {
    double hold_s = 1.0 / 7.5;            // s, that an action is held: a whole number of steps, at least one
    unsigned points = 3;                  // tracked on each device, from the tip backwards
    double spacing = 2e-3;                // m, of the tracked points along the rod
    unsigned memory = 2;                  // actions after which tracked points are remembered, the newest included
    std::vector<std::string> targets;     // of the scene; empty: all that can be reached
    double tolerance = 5e-3;              // m, tip to target: reached
    double time_limit_s = 0.0;            // s; 0: three times what the longest way takes at the speed limit, at least 10 s
    std::array<double, kRewardTerms> reward{10.0, 1.0, 0.0, -0.005}; // weights
    unsigned start_poses = 8;             // turns of the handle and insertions that episodes start from
    double start_spread = 10e-3;          // m, of the insertions
    std::optional<BudgetLimits> budget;   // none: the scene's
};

/// What a record and Python say of options, by name. The budget is said apart.
template <class Options, class Visitor>
void visit_options(Options& o, Visitor&& visit) {
    visit("hold", o.hold_s);
    visit("points", o.points);
    visit("spacing", o.spacing);
    visit("memory", o.memory);
    visit("targets", o.targets);
    visit("tolerance", o.tolerance);
    visit("time_limit", o.time_limit_s);
    visit("reward", o.reward);
    visit("start_poses", o.start_poses);
    visit("start_spread", o.start_spread);
}

struct TaskTarget {
    std::string name;
    Vec3 position = Vec3::Zero();    // m, at rest
    Index wall = 0;                  // vertex of the lumen that it moves with
    std::vector<double> remaining;   // [tree points] m, along the centreline
};

/// Where a tip is on the way.
struct WayPlace {
    Index point = 0;         // of the tree
    double remaining = 0.0;  // m, to the target along the centreline
    double distance = 0.0;   // m, to the target in a straight line
};

struct Task {
    std::shared_ptr<const PreparedScene> prepared;
    TaskOptions options;
    BudgetLimits budget;
    std::size_t lumen = 0; // body
    bool moves = false;    // the lumen does
    spheretree::CentrelineTree tree; // of the lumen, from the first instrument's port, at rest
    std::vector<Index> tree_wall;    // [tree points] vertex of the lumen that a point moves with
    std::vector<TaskTarget> targets;
    std::vector<State> starts;
    std::shared_ptr<const Simulator> prototype; // what those of environments are copied from
    std::uint64_t steps_per_action = 1;
    std::uint64_t action_limit = 1; // of an episode

    [[nodiscard]] const SceneModel& model() const noexcept { return prepared->model; }
    [[nodiscard]] std::size_t devices() const noexcept { return model().instruments.size(); }
    /// Numbers in an observation: tracked points, target, last action, insertion and rotation of each device.
    [[nodiscard]] std::size_t observation_size() const noexcept {
        return 3 * options.memory * devices() * options.points + 3 + 4 * devices();
    }
    /// m; where the target is now.
    [[nodiscard]] Vec3 target_now(std::size_t target, const State& state) const noexcept;
    /// cost   O(tree points)
    [[nodiscard]] WayPlace find_place(const Vec3& tip, std::size_t target, const State& state) const noexcept;
};

/// scene     whose targets are named
/// progress  called before each part of the work; may throw
/// fails     BadUsage: no instrument, no target that can be reached, an option out of its range; BadValue: a start pose failed
[[nodiscard]] Result<std::shared_ptr<const Task>> make_task(const Scene& scene, std::shared_ptr<const PreparedScene> prepared,
                                                            TaskOptions options, const Progress& progress = {});

/// Bounds of an observation: m and rad where the lumen's box and the drives' limits say.
/// low, high   [observation_size]
void find_observation_bounds(const Task& task, std::span<float> low, std::span<float> high);

} // namespace trocar::engine
