#include "engine/step/simulator.hpp"

#include "engine/state/state_bytes.hpp"
#include "engine/step/entry_checks.hpp"
#include "engine/step/finish_report.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/make_scratch.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/step.hpp"
#include "engine/step/tissue/tissue_stage.hpp"

namespace trocar::engine {

Simulator::Simulator(const SceneModel& model) : Simulator(model, own_clock_) {}

Simulator::Simulator(const SceneModel& model, const Clock& clock) : Simulator(model, clock, model.budget) {}

Simulator::Simulator(const SceneModel& model, const BudgetLimits& limits) : Simulator(model, own_clock_, limits) {}

Simulator::Simulator(const SceneModel& model, const Clock& clock, const BudgetLimits& limits) : Simulator(model, clock, limits, nullptr) {}

Simulator::Simulator(const Simulator& like, const BudgetLimits& limits) : Simulator(like.model_, own_clock_, limits, like.scratch_.get()) {}

Simulator::Simulator(const SceneModel& model, const Clock& clock, const BudgetLimits& limits, const StepScratch* like)
    : model_(model), limits_(limits), budget_(clock, limits), state_(make_initial_state(model)),
      scratch_(std::make_unique<StepScratch>(make_scratch(model, state_, like))) {
    if (like != nullptr) forget_scratch(*scratch_);
    report_first_instrument(model_, state_, scratch_->report);
    refuse(check_limits(limits));
    refuse(check_settings(model));
}

Simulator::~Simulator() = default;

/// No step will be taken, and the report says why.
void Simulator::refuse(const Result<void>& settings) {
    if (settings.ok() || stopped_) return;
    stopped_ = true;
    scratch_->report.finite = false;
    scratch_->report.failure = settings.error().to_string();
}

const StepReport& Simulator::step() {
    begin_step();
    return finish_step();
}

Result<void> Simulator::step(const Inputs& inputs) {
    Result<void> fine = check_inputs(inputs);
    if (!fine.ok()) return fine;
    begin_step(inputs);
    finish_step();
    return fine;
}

bool Simulator::begin_step(const Inputs& inputs) {
    if (stopped_) return false;
    if (begun_) return scratch_->report.finite;
    if (!check_inputs(inputs).ok()) return false;
    begun_ = true;
    budget_.set_limits(inputs.budget.value_or(limits_));
    return engine::begin_step(model_, inputs, state_, *scratch_, budget_);
}

const StepReport& Simulator::finish_step() {
    if (stopped_ || !begun_) return scratch_->report;
    begun_ = false;
    const StepReport& report = engine::finish_step(model_, state_, *scratch_, budget_);
    stopped_ = !report.finite;
    return report;
}

Result<void> Simulator::check_inputs(const Inputs& inputs) const { return engine::check_inputs(model_, inputs); }

Result<void> Simulator::restore(const State& state) {
    const auto wrong = [](std::string message) { return Error{.code = ErrorCode::BadValue, .message = std::move(message), .key = "restore"}; };
    if (std::string misfit = find_misfit(model_, state); !misfit.empty()) return wrong(std::move(misfit));
    begun_ = false;
    state_ = state;
    reserve_state(model_, state_);
    forget_scratch(*scratch_);
    StepReport& report = scratch_->report = StepReport{};
    report.step = state_.step;
    report.time_s = state_.time;
    scratch_->contacts.clear();
    report_first_instrument(model_, state_, report);
    stopped_ = false;
    refuse(check_limits(limits_));
    refuse(check_settings(model_));
    return {};
}

std::optional<DriveCommand> Simulator::follow_route(std::size_t instrument) {
    if (instrument >= model_.instruments.size() || !model_.instruments[instrument].route) return std::nullopt;
    return steer_along_route(model_, instrument, state_, scratch_->rods);
}

void Simulator::set_cull_device(std::unique_ptr<collision::CullBackend> device) {
    if (scratch_->rods.cull && device) scratch_->rods.cull->set_device(std::move(device));
}

std::span<const std::string> Simulator::cull_notes() const noexcept {
    return scratch_->rods.cull ? std::span<const std::string>(scratch_->rods.cull->notes()) : std::span<const std::string>();
}

const State& Simulator::state() noexcept {
    for (std::size_t i = 0; i < model_.bodies.size(); ++i) place_surface(model_, i, state_);
    return state_;
}

const StepReport& Simulator::report() const noexcept { return scratch_->report; }

std::span<const Contact> Simulator::contacts() const noexcept { return scratch_->contacts; }

std::span<const Contact> Simulator::sphere_contacts() const noexcept { return scratch_->traversal.coarse; }

const spheretree::Sphere* Simulator::find_sphere(std::size_t body, Index sphere) const noexcept {
    if (body >= model_.bodies.size() || !has_spheres(scratch_->solids, body)) return nullptr;
    return sphere < model_.bodies[body].covering.tree.sphere_count() ? known_sphere(body, sphere, scratch_->solids) : nullptr;
}

std::span<const spheretree::LinkStatus> Simulator::link_status(std::size_t instrument) const noexcept {
    if (instrument >= model_.instruments.size()) return {};
    return scratch_->rods.instruments[instrument].proven;
}

} // namespace trocar::engine
