#include "engine/episodes/rollout.hpp"

#include <algorithm>
#include <stdexcept>

namespace trocar::engine {

namespace {

struct Row {
    double force = 0.0;
    std::uint32_t exits = 0;
};

/// One action. False: a step failed.
bool take_action(Simulator& simulator, std::span<const double> action, std::uint64_t steps, Inputs& inputs, Row& row) {
    const double step_s = simulator.model().step_s;
    for (std::uint64_t k = 0; k < steps; ++k) {
        for (std::size_t i = 0; i < inputs.drive.size(); ++i) {
            const fem::RodState& rod = simulator.raw_state().instruments[i].rod;
            inputs.drive[i] = DriveCommand{rod.insertion + action[2 * i] * step_s, rod.rotation + action[2 * i + 1] * step_s};
        }
        if (!simulator.step(inputs).ok() || !simulator.report().finite) return false;
        row.force = std::max(row.force, simulator.report().max_contact_force_n);
        row.exits += simulator.report().lumen_exits;
    }
    return true;
}

} // namespace

Rollout::Rollout(const SceneModel& model, const BudgetLimits& budget, unsigned threads) : model_(model), pool_(threads) {
    simulators_.push_back(std::make_unique<Simulator>(model, budget));
    while (simulators_.size() < pool_.size()) simulators_.push_back(std::make_unique<Simulator>(*simulators_.front(), budget));
}

void Rollout::run(std::span<const State* const> states, std::span<const double> actions, std::size_t count, std::uint64_t steps,
                  const RolloutArrays& arrays, std::span<std::shared_ptr<const State>> final, const std::function<void()>& between) {
    const std::size_t devices = model_.instruments.size(), size = 2 * devices;
    const auto roll = [&](std::size_t r, unsigned thread) {
        Simulator& simulator = *simulators_[thread];
        if (const auto restored = simulator.restore(*states[r]); !restored.ok()) throw std::runtime_error(restored.error().to_string());
        Inputs inputs;
        inputs.drive.resize(devices);
        bool fine = true;
        arrays.done[r] = 0;
        for (std::size_t t = 0; t < count; ++t) {
            Row row;
            if (fine) fine = take_action(simulator, actions.subspan((r * count + t) * size, size), steps, inputs, row);
            arrays.done[r] += fine;
            const std::size_t at = r * count + t;
            arrays.force[at] = row.force, arrays.exits[at] = row.exits;
            for (std::size_t i = 0; i < devices; ++i) {
                const fem::RodState& rod = simulator.raw_state().instruments[i].rod;
                arrays.insertion[at * devices + i] = rod.insertion, arrays.rotation[at * devices + i] = rod.rotation;
                for (int axis = 0; axis < 3; ++axis) arrays.tip[3 * (at * devices + i) + static_cast<std::size_t>(axis)] = rod.position.back()[axis];
            }
        }
        arrays.hash[r] = hash_state(simulator.state());
        if (!final.empty()) final[r] = std::make_shared<const State>(simulator.state());
    };
    pool_.for_each(states.size(), roll, between);
}

} // namespace trocar::engine
