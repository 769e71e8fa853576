#include "engine/episodes/environment.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {

namespace {

/// Of the tolerance: the way along the centreline to a target that is reached is no longer, or the tip is in another branch.
constexpr double kWayTolerance = 2.0;

/// The place `back` metres behind the tip, along the rod's nodes.
Vec3 place_on_rod(std::span<const Vec3> nodes, double back) noexcept {
    for (std::size_t i = nodes.size() - 1; i > 0; --i) {
        const double length = std::sqrt((nodes[i] - nodes[i - 1]).squaredNorm());
        if (back <= length && length > 0.0) return nodes[i] + (back / length) * (nodes[i - 1] - nodes[i]);
        back -= length;
    }
    return nodes.front();
}

} // namespace

Environment::Environment(std::vector<std::shared_ptr<const Task>> tasks) : tasks_(std::move(tasks)) {
    const Task& first = task();
    simulator_ = std::make_shared<Simulator>(*first.prototype, first.budget);
    tracked_.resize(3 * first.options.memory * first.devices() * first.options.points);
    last_action_.resize(2 * first.devices());
    inputs_.drive.resize(first.devices());
}

Result<void> Environment::reset() {
    // always three numbers, so that what comes later does not depend on how many tasks there are
    const double draws[3] = {random_.uniform(), random_.uniform(), random_.uniform()};
    const auto draw = [](double share, std::size_t count) { return std::min(count - 1, static_cast<std::size_t>(share * static_cast<double>(count))); };
    if (const std::size_t drawn = draw(draws[0], tasks_.size()); drawn != task_index_) {
        task_index_ = drawn;
        simulator_ = std::make_shared<Simulator>(*task().prototype, task().budget);
    }
    target_ = draw(draws[1], task().targets.size());
    start_ = draw(draws[2], task().starts.size());
    if (auto restored = simulator_->restore(task().starts[start_]); !restored.ok()) return restored;
    std::fill(last_action_.begin(), last_action_.end(), 0.0);
    outcome_ = {};
    const WayPlace place = find_place();
    outcome_.remaining = place.remaining, outcome_.distance = place.distance;
    outcome_.hash = hash_state(simulator_->state());
    track(true);
    return {};
}

void Environment::step(std::span<const double> action) {
    const SceneModel& model = task().model();
    const double before = outcome_.remaining;
    const std::uint64_t number = outcome_.action + 1;
    outcome_ = {};
    outcome_.action = number;
    outcome_.remaining = before;
    for (std::size_t i = 0; i < task().devices(); ++i) {
        const DriveLimits& limits = model.instruments[i].limits;
        last_action_[2 * i] = std::clamp(action[2 * i], -kMillimetre * limits.speed, kMillimetre * limits.speed);
        last_action_[2 * i + 1] = std::clamp(action[2 * i + 1], -limits.rotation, limits.rotation);
    }
    for (std::uint64_t k = 0; k < task().steps_per_action; ++k) {
        for (std::size_t i = 0; i < task().devices(); ++i) {
            const fem::RodState& rod = simulator_->raw_state().instruments[i].rod;
            inputs_.drive[i] = DriveCommand{rod.insertion + last_action_[2 * i] / kMillimetre * model.step_s,
                                            rod.rotation + last_action_[2 * i + 1] * model.step_s};
        }
        if (const auto taken = simulator_->step(inputs_); !taken.ok()) {
            outcome_.failure = taken.error().to_string();
            break;
        }
        const StepReport& report = simulator_->report();
        if (!report.finite) {
            outcome_.failure = report.failure;
            break;
        }
        outcome_.force = std::max(outcome_.force, report.max_contact_force_n);
        outcome_.exits += report.lumen_exits, outcome_.unresolved += report.unresolved, outcome_.assumed += report.assumed;
        outcome_.overruns += !report.budget_kept;
        outcome_.exact_steps += report.exact_ran, outcome_.contacts += report.pressing_contacts;
    }
    judge(before);
    track(false);
}

/// The instrument whose tip is nearest to the target along the way counts.
WayPlace Environment::find_place() const noexcept {
    WayPlace best;
    for (std::size_t i = 0; i < task().devices(); ++i) {
        const WayPlace place = task().find_place(simulator_->raw_state().instruments[i].rod.position.back(), target_, simulator_->raw_state());
        if (i == 0 || place.remaining < best.remaining) best = place;
    }
    return best;
}

void Environment::judge(double remaining_before) {
    const TaskOptions& options = task().options;
    const State& state = simulator_->state(); // surfaces evaluated
    const WayPlace place = find_place();
    outcome_.remaining = place.remaining, outcome_.distance = place.distance;
    outcome_.terminated = outcome_.failure.empty() && place.distance <= options.tolerance && place.remaining <= kWayTolerance * options.tolerance;
    outcome_.truncated = !outcome_.failure.empty() || (!outcome_.terminated && outcome_.action >= task().action_limit);
    const std::array<double, kRewardTerms> measured{remaining_before - place.remaining, outcome_.terminated ? 1.0 : 0.0, outcome_.force, 1.0};
    for (std::size_t k = 0; k < kRewardTerms; ++k) outcome_.reward += outcome_.terms[k] = options.reward[k] * measured[k];
    outcome_.hash = hash_state(state);
}

void Environment::track(bool fill) {
    const TaskOptions& options = task().options;
    const std::size_t newest = 3 * task().devices() * options.points;
    if (!fill) std::copy_backward(tracked_.begin(), tracked_.end() - static_cast<std::ptrdiff_t>(newest), tracked_.end());
    auto at = tracked_.begin();
    for (const InstrumentState& instrument : simulator_->raw_state().instruments)
        for (unsigned p = 0; p < options.points; ++p) {
            const Vec3 place = place_on_rod(instrument.rod.position, p * options.spacing);
            for (int axis = 0; axis < 3; ++axis) *at++ = static_cast<float>(kMillimetre * place[axis]);
        }
    if (fill)
        for (unsigned m = 1; m < options.memory; ++m) std::copy_n(tracked_.begin(), newest, tracked_.begin() + static_cast<std::ptrdiff_t>(m * newest));
}

void Environment::observe(std::span<float> observation) const noexcept {
    auto at = std::copy(tracked_.begin(), tracked_.end(), observation.begin());
    const State& state = simulator_->raw_state();
    const Vec3 target = task().target_now(target_, state);
    for (int axis = 0; axis < 3; ++axis) *at++ = static_cast<float>(kMillimetre * target[axis]);
    for (const double value : last_action_) *at++ = static_cast<float>(value);
    for (const InstrumentState& instrument : state.instruments) {
        *at++ = static_cast<float>(kMillimetre * instrument.rod.insertion);
        const double turns = instrument.rod.rotation / (2.0 * std::numbers::pi);
        *at++ = static_cast<float>(2.0 * std::numbers::pi * (turns - std::round(turns)));
    }
}

} // namespace trocar::engine
