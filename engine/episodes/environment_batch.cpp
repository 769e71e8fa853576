#include "engine/episodes/environment_batch.hpp"

#include <algorithm>
#include <stdexcept>

namespace trocar::engine {

EnvironmentBatch::EnvironmentBatch(const std::vector<std::vector<std::shared_ptr<const Task>>>& tasks, unsigned threads, Autoreset autoreset,
                                   const BatchArrays& arrays, std::vector<std::vector<PixelCamera>> cameras)
    : cameras_(std::move(cameras)), observation_size_(tasks.front().front()->observation_size()),
      pixels_size_(cameras_.empty() ? 0 : cameras_.front().front().options().size()), autoreset_(autoreset), arrays_(arrays), failures_(tasks.size()),
      ended_(tasks.size(), 0), pool_(threads) {
    environments_.reserve(tasks.size());
    for (const auto& each : tasks) environments_.emplace_back(each);
}

void EnvironmentBatch::begin_episode(std::size_t i) {
    if (const auto begun = environments_[i].reset(); !begun.ok()) throw std::runtime_error(begun.error().to_string());
    if (!cameras_.empty()) camera(i).begin_episode();
    observe(i);
    ended_[i] = 0;
}

void EnvironmentBatch::observe(std::size_t i) {
    const Environment& environment = environments_[i];
    environment.observe({arrays_.observation + i * observation_size_, observation_size_});
    if (pixels_size_ == 0) return;
    camera(i).take(environment.simulator()->state(), environment.outcome().hash, arrays_.pixels + i * pixels_size_, arrays_.tips + i * 2 * devices());
}

XrayObservation EnvironmentBatch::observe_all(std::size_t i) {
    const Environment& environment = environments_[i];
    return camera(i).observe_all(environment.simulator()->state(), environment.outcome().hash);
}

void EnvironmentBatch::write_outcome(std::size_t i) {
    const Environment& environment = environments_[i];
    const ActionOutcome& o = environment.outcome();
    arrays_.reward[i] = o.reward;
    arrays_.terminated[i] = o.terminated;
    arrays_.truncated[i] = o.truncated;
    arrays_.outcome[i] = {o.remaining, o.distance, o.force, o.terms, o.exits, o.unresolved, o.assumed, o.overruns, o.exact_steps, o.contacts,
                          o.action, o.hash, environment.task_index(), environment.target(), environment.start(), !o.failure.empty(), o.action == 0};
    failures_[i] = o.failure;
}

void EnvironmentBatch::reset(std::span<const std::optional<std::uint64_t>> seeds, std::span<const std::uint8_t> mask,
                             const std::function<void()>& between) {
    const bool all = mask.empty();
    if (all) ready_ = false;
    more_.store(false, std::memory_order_relaxed);
    pool_.for_each(
        count(),
        [&](std::size_t i, unsigned) {
            const bool begins = all || mask[i] != 0;
            if (begins && !seeds.empty() && seeds[i]) environments_[i].seed(*seeds[i]);
            if (begins) begin_episode(i);
            else observe(i);
            write_outcome(i);
            if (!begins) arrays_.outcome[i].began = 0;
        },
        between);
    if (all) ready_ = true;
}

void EnvironmentBatch::step_one(std::size_t i, std::span<const double> action) {
    Environment& environment = environments_[i];
    if (ended_[i] != 0 && autoreset_ == Autoreset::NextStep) {
        begin_episode(i);
        write_outcome(i);
        return;
    }
    environment.step(action);
    observe(i);
    write_outcome(i);
    if (arrays_.outcome[i].failed != 0) more_.store(true, std::memory_order_relaxed);
    if (!arrays_.terminated[i] && !arrays_.truncated[i]) return;
    ended_[i] = 1;
    if (autoreset_ != Autoreset::SameStep) return;
    std::copy_n(arrays_.observation + i * observation_size_, observation_size_, arrays_.final_observation + i * observation_size_);
    if (pixels_size_ > 0) std::copy_n(arrays_.pixels + i * pixels_size_, pixels_size_, arrays_.final_pixels + i * pixels_size_);
    begin_episode(i);
    arrays_.outcome[i].began = 1;
    more_.store(true, std::memory_order_relaxed);
}

void EnvironmentBatch::step(std::span<const double> actions, const std::function<void()>& between) {
    ready_ = false; // until all are done: after an exception some are
    more_.store(false, std::memory_order_relaxed);
    const std::size_t size = 2 * devices();
    pool_.for_each(count(), [&](std::size_t i, unsigned) { step_one(i, actions.subspan(i * size, size)); }, between);
    ready_ = true;
}

} // namespace trocar::engine
