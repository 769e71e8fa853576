// Environments side by side on a pool of threads. What each of them does depends on its own seed and actions alone.
#pragma once

#include "engine/episodes/environment.hpp"
#include "engine/episodes/pixels.hpp"
#include "engine/episodes/thread_pool.hpp"

#include <atomic>

namespace trocar::engine {

/// What becomes of an environment whose episode has ended.
enum class Autoreset : std::uint8_t {
    NextStep, // the next action begins an episode, and is not taken
    SameStep, // a new episode begins at once; its first observation is returned, the last one's stands beside it
    Disabled, // whoever steps resets
};

/// An ActionOutcome as a row of numbers, and where its episode stands. Every member has 8 bytes: rows are read as an array of records.
struct OutcomeRow {
    double remaining, distance, force;
    std::array<double, kRewardTerms> terms;
    std::uint64_t exits, unresolved, assumed, overruns, exact_steps, contacts, action, hash;
    std::uint64_t task, target, start; // of the episode
    std::uint64_t failed, began;       // flags: a failure; an episode began in this step or reset
};

/// Where answers go: each [count][...], owned by the caller.
struct BatchArrays {
    float* observation = nullptr;       // [observation_size]
    float* final_observation = nullptr; // [observation_size] with SameStep, of episodes that ended in this step
    std::uint8_t* pixels = nullptr;       // [rows][columns][channels] where there are cameras
    std::uint8_t* final_pixels = nullptr; // likewise of final_observation
    double* tips = nullptr;               // [devices][2] pixels, likewise
    double* reward = nullptr;
    bool* terminated = nullptr;
    bool* truncated = nullptr;
    OutcomeRow* outcome = nullptr; // of the last action; with SameStep and an ended episode, of that episode's last one
};

class EnvironmentBatch {
public:
    /// tasks     of each environment: as Environment takes them
    /// threads   at least 1
    /// cameras   [count][tasks] of the same options; empty: there are none
    EnvironmentBatch(const std::vector<std::vector<std::shared_ptr<const Task>>>& tasks, unsigned threads, Autoreset autoreset,
                     const BatchArrays& arrays, std::vector<std::vector<PixelCamera>> cameras = {});

    [[nodiscard]] std::size_t count() const noexcept { return environments_.size(); }
    [[nodiscard]] std::size_t observation_size() const noexcept { return observation_size_; }
    [[nodiscard]] std::size_t devices() const noexcept { return environments_.front().task().devices(); }
    [[nodiscard]] const ThreadPool& pool() const noexcept { return pool_; }
    [[nodiscard]] const Environment& at(std::size_t i) const { return environments_[i]; }

    /// Where answers go from here on. A reset with a mask writes the rows of others anew, as they are.
    void write_to(const BatchArrays& arrays) noexcept { arrays_ = arrays; }
    /// Begins episodes, and writes their observations.
    /// seeds    [count] none: that environment goes on with its sequence; empty: all do
    /// mask     [count] which; empty: all
    /// between  as ThreadPool::for_each
    void reset(std::span<const std::optional<std::uint64_t>> seeds, std::span<const std::uint8_t> mask, const std::function<void()>& between = {});
    /// actions  [count][devices][2] mm/s and rad/s, finite
    void step(std::span<const double> actions, const std::function<void()>& between = {});

    /// All that an environment's picture says now; there are cameras.
    [[nodiscard]] XrayObservation observe_all(std::size_t i);
    /// Why the last action of an environment failed; empty where it did not.
    [[nodiscard]] const std::string& failure(std::size_t i) const noexcept { return failures_[i]; }
    /// In the last step some environment failed, or with SameStep an episode ended.
    [[nodiscard]] bool has_more_to_tell() const noexcept { return more_.load(std::memory_order_relaxed); }
    /// Environments that have an episode: none of them before their first reset, nor after an exception.
    [[nodiscard]] bool ready() const noexcept { return ready_; }

private:
    void begin_episode(std::size_t i);
    void observe(std::size_t i);
    [[nodiscard]] PixelCamera& camera(std::size_t i) { return cameras_[i][environments_[i].task_index()]; }
    void step_one(std::size_t i, std::span<const double> action);
    void write_outcome(std::size_t i);

    std::vector<Environment> environments_;
    std::vector<std::vector<PixelCamera>> cameras_;
    std::size_t observation_size_, pixels_size_; // of one observation
    Autoreset autoreset_;
    BatchArrays arrays_;
    std::vector<std::string> failures_;
    std::vector<std::uint8_t> ended_;
    bool ready_ = false;
    std::atomic<bool> more_{false};
    ThreadPool pool_;
};

} // namespace trocar::engine
