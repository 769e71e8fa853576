#include "engine/step/simulator.hpp"

#include "engine/state/state.hpp"
#include "engine/state/state_bytes.hpp"
#include "engine/step/entry_checks.hpp"
#include "engine/step/finish_report.hpp"
#include "engine/step/first_contacts.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/make_scratch.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/step.hpp"
#include "engine/step/tissue/tissue_stage.hpp"
#include "engine/time/clock.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

struct Simulator::Parts {
    /// given   nullptr: monotonic
    /// fresh   no other state is put in place of the initial one
    Parts(std::optional<Prepared> scene, const SceneModel& of, const Clock* given, const BudgetLimits& with, const StepScratch* like,
          bool fresh = true);
    void refuse(const Result<void>& settings);
    void check();

    std::optional<Prepared> prepared; // holds the model, if anybody here does
    const SceneModel& model;
    MonotonicClock monotonic;
    const Clock* clock; // that was given; nullptr: monotonic
    BudgetLimits limits;
    StepBudget budget;
    State state;
    StepScratch scratch;
    bool stopped = false;
    bool begun = false; // a step, and not finished it
};

Simulator::Parts::Parts(std::optional<Prepared> scene, const SceneModel& of, const Clock* given, const BudgetLimits& with,
                        const StepScratch* like, bool fresh)
    : prepared(std::move(scene)), model(of), clock(given), limits(with), budget(given != nullptr ? *given : monotonic, with),
      state(make_initial_state(of)), scratch(make_scratch(of, state, like)) {
    if (like != nullptr) forget_walls(scratch.rods);
    report_first_instrument(model, state, scratch.report);
    check();
    if (fresh && !stopped) find_first_contacts(model, state, scratch);
}

/// No step will be taken, and the report says why.
void Simulator::Parts::refuse(const Result<void>& settings) {
    if (settings.ok() || stopped) return;
    stopped = true;
    scratch.report.finite = false;
    scratch.report.failure = settings.error().to_string();
}

void Simulator::Parts::check() {
    refuse(check_limits(limits));
    refuse(check_settings(model));
}

Simulator::Simulator(std::unique_ptr<Parts> parts) noexcept : parts_(std::move(parts)) {}

Simulator::Simulator(const Prepared& scene) : Simulator(scene, scene.model().budget) {}

Simulator::Simulator(const Prepared& scene, const BudgetLimits& limits)
    : Simulator(std::make_unique<Parts>(scene, scene.model(), nullptr, limits, nullptr)) {}

Simulator::Simulator(const SceneModel& model) : Simulator(model, model.budget) {}

Simulator::Simulator(const SceneModel& model, const Clock& clock) : Simulator(model, clock, model.budget) {}

Simulator::Simulator(const SceneModel& model, const BudgetLimits& limits)
    : Simulator(std::make_unique<Parts>(std::nullopt, model, nullptr, limits, nullptr)) {}

Simulator::Simulator(const SceneModel& model, const Clock& clock, const BudgetLimits& limits)
    : Simulator(std::make_unique<Parts>(std::nullopt, model, &clock, limits, nullptr)) {}

Simulator::Simulator(const Simulator& like, const BudgetLimits& limits)
    : Simulator(std::make_unique<Parts>(like.parts_->prepared, like.parts_->model, nullptr, limits, &like.parts_->scratch)) {}

Simulator::~Simulator() = default;
Simulator::Simulator(Simulator&& other) noexcept = default;
Simulator& Simulator::operator=(Simulator&& other) noexcept = default;

Simulator Simulator::fork() {
    Parts& own = *parts_;
    Simulator other(std::make_unique<Parts>(own.prepared, own.model, own.clock, own.limits, &own.scratch, false));
    const Result<void> restored = other.restore(state());
    assert(restored.ok()); // it is a state of this model
    (void)restored;
    other.parts_->stopped = own.stopped;
    other.parts_->scratch.report = own.scratch.report;
    other.parts_->scratch.contacts = own.scratch.contacts;
    return other;
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
    if (parts_->stopped) return false;
    if (parts_->begun) return parts_->scratch.report.finite;
    if (!check_inputs(inputs).ok()) return false;
    parts_->begun = true;
    parts_->budget.set_limits(inputs.budget.value_or(parts_->limits));
    return engine::begin_step(parts_->model, inputs, parts_->state, parts_->scratch, parts_->budget);
}

const StepReport& Simulator::finish_step() {
    if (parts_->stopped || !parts_->begun) return parts_->scratch.report;
    parts_->begun = false;
    const StepReport& report = engine::finish_step(parts_->model, parts_->state, parts_->scratch, parts_->budget);
    parts_->stopped = !report.finite;
    return report;
}

Result<void> Simulator::check_inputs(const Inputs& inputs) const { return engine::check_inputs(parts_->model, inputs); }

Result<void> Simulator::restore(const State& state) {
    const auto wrong = [](std::string message) { return Error{.code = ErrorCode::BadValue, .message = std::move(message), .key = "restore"}; };
    if (std::string misfit = find_misfit(parts_->model, state); !misfit.empty()) return wrong(std::move(misfit));
    parts_->begun = false;
    parts_->state = state;
    reserve_state(parts_->model, parts_->state);
    forget_walls(parts_->scratch.rods);
    StepReport& report = parts_->scratch.report = StepReport{};
    report.step = parts_->state.step;
    report.time_s = parts_->state.time;
    parts_->scratch.contacts.clear();
    report_first_instrument(parts_->model, parts_->state, report);
    parts_->stopped = false;
    parts_->check();
    return {};
}

SavedState Simulator::save() { return std::make_shared<const State>(state()); }

std::optional<DriveCommand> Simulator::follow_route(std::size_t instrument) {
    if (instrument >= parts_->model.instruments.size() || !parts_->model.instruments[instrument].route) return std::nullopt;
    return steer_along_route(parts_->model, instrument, parts_->state, parts_->scratch.rods);
}

void Simulator::set_cull_device(std::unique_ptr<collision::CullBackend> device) {
    if (parts_->scratch.rods.cull && device) parts_->scratch.rods.cull->set_device(std::move(device));
}

std::span<const std::string> Simulator::cull_notes() const noexcept {
    return parts_->scratch.rods.cull ? std::span<const std::string>(parts_->scratch.rods.cull->notes()) : std::span<const std::string>();
}

const BudgetLimits& Simulator::budget() const noexcept { return parts_->budget.limits(); }

void Simulator::set_probe(StepProbe* probe) noexcept { parts_->budget.set_probe(probe); }

DecisionTape& Simulator::tape() noexcept { return parts_->budget.tape(); }

const SceneModel& Simulator::model() const noexcept { return parts_->model; }

std::size_t Simulator::body_count() const noexcept { return count_bodies(parts_->model); }

std::size_t Simulator::instrument_count() const noexcept { return count_instruments(parts_->model); }

std::optional<std::size_t> Simulator::find_body(std::string_view name) const noexcept { return engine::find_body(parts_->model, name); }

std::optional<std::size_t> Simulator::find_instrument(std::string_view name) const noexcept {
    return engine::find_instrument(parts_->model, name);
}

BodyView Simulator::body(std::size_t index) noexcept {
    if (index >= body_count()) return {};
    place_surface(parts_->model, index, parts_->state);
    return view_body(parts_->model, parts_->state, index);
}

InstrumentView Simulator::instrument(std::size_t index) const noexcept {
    return index < instrument_count() ? view_instrument(parts_->model, parts_->state, index) : InstrumentView{};
}

std::uint64_t Simulator::hash() noexcept { return hash_state(state()); }

const State& Simulator::raw_state() const noexcept { return parts_->state; }

const State& Simulator::state() noexcept {
    for (std::size_t i = 0; i < parts_->model.bodies.size(); ++i) place_surface(parts_->model, i, parts_->state);
    return parts_->state;
}

StepScratch& Simulator::scratch() noexcept { return parts_->scratch; }

const StepReport& Simulator::report() const noexcept { return parts_->scratch.report; }

std::span<const Contact> Simulator::contacts() const noexcept { return parts_->scratch.contacts; }

std::span<const Contact> Simulator::sphere_contacts() const noexcept { return parts_->scratch.traversal.coarse; }

const spheretree::Sphere* Simulator::find_sphere(std::size_t body, Index sphere) const noexcept {
    if (body >= parts_->model.bodies.size() || !has_spheres(parts_->scratch.solids, body)) return nullptr;
    return sphere < parts_->model.bodies[body].covering.tree.sphere_count() ? known_sphere(body, sphere, parts_->scratch.solids) : nullptr;
}

std::span<const spheretree::LinkStatus> Simulator::link_status(std::size_t instrument) const noexcept {
    if (instrument >= parts_->model.instruments.size()) return {};
    return parts_->scratch.rods.instruments[instrument].proven;
}

} // namespace trocar::engine
