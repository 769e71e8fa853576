// Many sequences of drive commands from many states, on a pool of threads.
#pragma once

#include "engine/episodes/thread_pool.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <memory>
#include <vector>

namespace trocar::engine {

/// Where answers go: each [rollouts][actions][...], owned by the caller. Rows after a failure repeat the last good one.
struct RolloutArrays {
    double* tip = nullptr;        // [devices][3] m
    double* insertion = nullptr;  // [devices] m
    double* rotation = nullptr;   // [devices] rad
    double* force = nullptr;      // N, largest at one place on a wall during the action
    std::uint32_t* exits = nullptr; // instrument vertices outside the lumen, summed over the action's steps
    std::uint64_t* hash = nullptr; // [rollouts] hash_state at the end
    std::uint64_t* done = nullptr; // [rollouts] actions that were taken whole
};

class Rollout {
public:
    /// The model must outlive it.
    Rollout(const SceneModel& model, const BudgetLimits& budget, unsigned threads);

    [[nodiscard]] const SceneModel& model() const noexcept { return model_; }
    [[nodiscard]] const ThreadPool& pool() const noexcept { return pool_; }

    /// states    [rollouts], of the model
    /// actions   [rollouts][count][devices][2] m/s and rad/s, finite; each is held for `steps` steps
    /// final     empty, or [rollouts] where the states at the end go
    /// between   as ThreadPool::for_each
    void run(std::span<const State* const> states, std::span<const double> actions, std::size_t count, std::uint64_t steps,
             const RolloutArrays& arrays, std::span<std::shared_ptr<const State>> final, const std::function<void()>& between = {});

private:
    const SceneModel& model_;
    std::vector<std::unique_ptr<Simulator>> simulators_; // [thread]
    ThreadPool pool_;
};

} // namespace trocar::engine
