// One environment: episodes of a task, one after another, in one simulator. All that happens follows from the seed and the actions.
#pragma once

#include "assets/anatomy/random.hpp"
#include "engine/episodes/task.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace trocar::engine {

/// What one action came to.
struct ActionOutcome {
    double reward = 0.0;
    std::array<double, kRewardTerms> terms{}; // weighted: their sum is the reward
    bool terminated = false;                  // the target was reached
    bool truncated = false;                   // by the time limit, or by a failure
    double remaining = 0.0;                   // m, to the target along the centreline
    double distance = 0.0;                    // m, to the target in a straight line
    double force = 0.0;                       // N, largest at one place on a wall
    std::uint64_t exits = 0, unresolved = 0, assumed = 0, overruns = 0; // summed over the action's steps
    std::uint64_t exact_steps = 0, contacts = 0;
    std::uint64_t action = 0; // of the episode, from 1; 0: it has just begun
    std::uint64_t hash = 0;   // hash_state
    std::string failure;      // empty: none
};

class Environment {
public:
    /// tasks   of the same number of devices and the same observations; a reset draws one of them
    explicit Environment(std::vector<std::shared_ptr<const Task>> tasks);

    /// From here on everything is drawn from this seed.
    void seed(std::uint64_t value) noexcept { random_ = anatomy::Random(value); }
    /// Begins an episode: draws the task, its target and its start pose.
    /// fails   as Simulator::restore
    [[nodiscard]] Result<void> reset();
    /// actions  [devices][2] mm/s and rad/s, finite; taken within the limits of the device's drive
    void step(std::span<const double> action);

    /// observation   [observation_size]
    void observe(std::span<float> observation) const noexcept;

    [[nodiscard]] const ActionOutcome& outcome() const noexcept { return outcome_; }
    [[nodiscard]] const Task& task() const noexcept { return *tasks_[task_index_]; }
    [[nodiscard]] std::size_t task_index() const noexcept { return task_index_; }
    [[nodiscard]] std::size_t target() const noexcept { return target_; }
    [[nodiscard]] std::size_t start() const noexcept { return start_; }
    [[nodiscard]] const std::shared_ptr<Simulator>& simulator() const noexcept { return simulator_; }

private:
    void track(bool fill);
    void judge(double remaining_before);
    [[nodiscard]] WayPlace find_place() const noexcept;

    std::vector<std::shared_ptr<const Task>> tasks_;
    std::size_t task_index_ = 0, target_ = 0, start_ = 0;
    anatomy::Random random_{0};
    std::shared_ptr<Simulator> simulator_;
    Inputs inputs_;
    std::vector<float> tracked_;    // [memory][devices][points][3] mm, newest first
    std::vector<double> last_action_; // [devices][2]
    ActionOutcome outcome_;
};

} // namespace trocar::engine
