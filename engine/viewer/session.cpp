#include "engine/viewer/session.hpp"

#include "engine/effects/registry.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/instrument/script.hpp"
#include "engine/step/tissue/pull_stage.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine::viewer {

namespace {

/// 1/s: an effect that fades is switched at this rate, or breathing would throw the organ.
constexpr double kFadeRate = 1.0;
/// Units of a step with an exact stage beside the walls' refit, for each triangle of the instruments' skins: ten times what any of the
/// demo scene's 3,000 steps took (10, `work_units` of its exact run).
constexpr std::uint64_t kUnitsPerSkinTriangle = 100;
/// Single steps that may wait: a key that repeats faster than steps are taken.
constexpr unsigned kWaitingSteps = 3;

/// In mode Work a wall's refit is charged; in the other modes it is measured, and not among a step's units.
std::uint64_t refit_units(const SceneModel& model) noexcept {
    std::uint64_t triangles = 0;
    for (const InstrumentModel& instrument : model.instruments)
        if (model.bodies[instrument.lumen].moves()) triangles += model.bodies[instrument.lumen].surface.triangles.size();
    return kUnitsPerRefitTriangle * triangles;
}

template <class... Ts>
struct Overloaded : Ts... {
    using Ts::operator()...;
};

} // namespace

Session::Session(const Scene& scene, const PreparedScene& prepared, std::function<void(Simulator&)> equip)
    : scene_(scene), model_(prepared.model), equip_(std::move(equip)) {
    for (const EffectDescriptor* effect : registered_effects())
        permitted_[index_of(*effect)] = status_.effects[index_of(*effect)] = effect->scale != nullptr && has_effect(model_, *effect);
    status_.budget = model_.budget;
    injection_ = effects::find_injection(model_);
    if (has_instrument()) {
        script_ = model_.instruments[kLeadInstrument].path;
        has_script_ = model_.instruments[kLeadInstrument].route.has_value() || !script_.empty();
    }
    begin_run();
}

/// From rest, with the effects and the budget as they are set now.
void Session::begin_run() {
    if (has_instrument()) {
        recording_ = begin_recording();
        drive_position_ = recording_->start();
        model_.instruments[kLeadInstrument].path = {{0.0, drive_position_.insertion, drive_position_.rotation}}; // where a run that reads the recording starts
    }
    for (const EffectDescriptor* effect : registered_effects())
        if (permits(*effect)) inputs_.live.set(*effect, status_.effects[index_of(*effect)] ? 1.0 : 0.0);
    inputs_.drive.assign(model_.instruments.size(), std::nullopt);
    inputs_.pull.reset();
    status_.injection = injection_;
    if (injection_) effects::set_injection_start(model_, injection_->start);
    simulator_.emplace(model_, status_.budget);
    if (equip_) equip_(*simulator_);
    status_.grabbed = status_.stepped = false;
    status_.drive = {};
    goal_.reset();
    single_steps_ = 0;
    ++run_;
}

std::shared_ptr<Recording> Session::begin_recording() const {
    const DriveCommand start = script_.empty() ? DriveCommand{model_.instruments[kLeadInstrument].inserted, 0.0} : evaluate_path(script_, 0.0);
    auto recording = std::make_shared<Recording>(scene_.units, start, status_.budget);
    if (status_.effects != permitted_) recording->spoil(Spoiler::EffectSwitched);
    return recording;
}

void Session::apply(const Command& command) {
    const auto spoil = [this](Spoiler by) {
        if (recording_) recording_->spoil(by);
    };
    std::visit(Overloaded{
                   [&](const Drive& drive) {
                       status_.drive = drive;
                       goal_.reset();
                       if (drive.insertion != 0.0 || drive.rotation != 0.0) status_.script = false; // user input takes over
                   },
                   [&](const DriveTo& to) {
                       status_.drive = {};
                       status_.script = false;
                       goal_ = DriveCommand{to.insertion, to.rotation};
                   },
                   [&](const FollowScript& follow) {
                       status_.script = follow.on && has_script_;
                       if (status_.script) goal_.reset();
                   },
                   [&](const SetBudget& set) {
                       Inputs tried;
                       tried.budget = set.limits;
                       if (!simulator_->check_inputs(tried).ok()) return; // the page offers no such budget
                       status_.budget = set.limits;
                       if (has_instrument() && simulator_->state().step == 0)
                           recording_ = begin_recording();
                       else
                           spoil(Spoiler::BudgetChanged);
                   },
                   [&](const Pause& pause) {
                       status_.paused = pause.on;
                       single_steps_ = 0;
                   },
                   [&](const SingleStep&) { single_steps_ = std::min(single_steps_ + (status_.paused ? 1u : 0u), kWaitingSteps); },
                   [&](const Pace& pace) { status_.pace = pace.factor; },
                   [&](const SwitchEffect& set) { switch_effect(*set.effect, set.on); },
                   [&](const Grab& grab) {
                       if (grab.body >= model_.bodies.size() || !can_be_pulled(model_, grab.body)) return;
                       Inputs tried;
                       tried.pull = Pull{grab.body, grab.vertex, grab.target};
                       if (!simulator_->check_inputs(tried).ok()) return;
                       inputs_.pull = tried.pull;
                       status_.grabbed = true;
                       spoil(Spoiler::TissuePulled);
                   },
                   [&](const LetGo&) {
                       inputs_.pull.reset();
                       status_.grabbed = false;
                   },
                   [&](const Inject&) { inject(); },
                   [&](const Restart&) { begin_run(); },
                   [&](const SaveState& save_as) { save(save_as.name); },
                   [&](const RestoreState& asked) {
                       if (const Saved* saved = find_saved(asked.saved)) restore(*saved);
                   },
                   [&](const ForgetState& asked) {
                       std::erase_if(saved_, [&](const Saved& saved) { return saved.mark.id == asked.saved; });
                       list_saved();
                   },
                   [&](const Seal&) {}, // the loop's
               },
               command);
}

/// What the scene injects, from now on. While it is being injected, nothing.
void Session::inject() {
    if (!status_.injection || !recording_) return; // contrast flows where an instrument is
    effects::Injection& injection = *status_.injection;
    const double now = simulator_->state().time;
    if (now >= injection.start && now < injection.start + injection.duration) return;
    if (now > injection.start) recording_->spoil(Spoiler::InjectedAgain);
    if (scene_.positions.contains("effects[0]")) recording_->spoil(Spoiler::InjectedInList);
    injection.start = recording_->add_injection(now);
    effects::set_injection_start(model_, injection.start);
}

/// Not where the run has stopped: there the last step's drive command is recorded, and the step was not taken.
void Session::save(const StateName& name) {
    if (stopped()) return;
    std::erase_if(saved_, [&](const Saved& saved) { return saved.mark.name == name; });
    if (saved_.size() < kMostSaved) {
        SavedState state = simulator_->save();
        const SavedMark mark{++saves_, name, state->step, state->time};
        saved_.push_back({mark, std::move(state), status_, inputs_.live, drive_position_, recording_, recording_ ? recording_->mark() : Recording::Mark{}});
    }
    list_saved();
}

void Session::list_saved() noexcept {
    status_.saved.count = saved_.size();
    for (std::size_t k = 0; k < saved_.size(); ++k) status_.saved.marks[k] = saved_[k].mark;
}

const Saved* Session::find_saved(std::uint32_t id) const noexcept {
    const auto found = std::find_if(saved_.begin(), saved_.end(), [id](const Saved& saved) { return saved.mark.id == id; });
    return found == saved_.end() ? nullptr : &*found;
}

/// Effects, budget, injection and script are those of then; pause, pace and who pulls are those of now. The recording is that of the run
/// up to there, and goes on.
void Session::restore(const Saved& saved) {
    if (!simulator_->restore(*saved.state).ok()) return; // it is a state of this model
    const SessionStatus now = status_;
    status_ = saved.status;
    status_.paused = now.paused;
    status_.pace = now.pace;
    status_.saved = now.saved;
    status_.drive = {};
    goal_.reset();
    status_.grabbed = status_.stepped = false;
    inputs_.live = saved.live;
    inputs_.pull.reset();
    drive_position_ = saved.drive_position;
    if (status_.injection) effects::set_injection_start(model_, status_.injection->start);
    if (saved.recording) recording_ = std::make_shared<Recording>(*saved.recording, saved.recorded);
    single_steps_ = 0;
    ++run_;
}

void Session::switch_effect(const EffectDescriptor& effect, bool on) {
    if (!permits(effect) || status_.effects[index_of(effect)] == on) return;
    status_.effects[index_of(effect)] = on;
    if (recording_) recording_->spoil(Spoiler::EffectSwitched);
    if (!effect.fades) inputs_.live.set(effect, on ? 1.0 : 0.0);
    if (&effect == &effects::elasticity && !on) apply(LetGo{});
}

void Session::fade_effects() {
    const double change = kFadeRate * model_.step_s;
    for (const EffectDescriptor* effect : registered_effects()) {
        if (!effect->fades || !permits(*effect)) continue;
        const double now = inputs_.live.share(*effect), goal = status_.effects[index_of(*effect)] ? 1.0 : 0.0;
        inputs_.live.set(*effect, now + std::clamp(goal - now, -change, change));
    }
}

DriveCommand Session::wanted_drive_command() {
    const InstrumentModel& instrument = model_.instruments[kLeadInstrument];
    const State& state = simulator_->state();
    const double dt = model_.step_s;
    if (goal_) return *goal_;
    if (!status_.script)
        return {drive_position_.insertion + status_.drive.insertion * instrument.limits.speed * dt,
                drive_position_.rotation + status_.drive.rotation * instrument.limits.rotation * dt};
    if (const auto routed = simulator_->follow_route(0)) return *routed;
    return evaluate_path(script_, state.time + dt);
}

/// The drive never runs ahead of the instrument by more than one step: where the wall stops the instrument, it waits. So it reverses
/// at once, and no two rows of the recording lie further apart than the limits allow.
void Session::follow_drive_command() {
    const InstrumentModel& instrument = model_.instruments[kLeadInstrument];
    const fem::RodState& rod = simulator_->state().instruments[kLeadInstrument].rod;
    const double dt = model_.step_s;
    const double reach = std::min(instrument.limits.speed * dt, kDriveReach), turn = instrument.limits.rotation * dt;
    DriveCommand wanted = limit_command(drive_position_, wanted_drive_command(), instrument.limits, dt);
    wanted.insertion = std::clamp(wanted.insertion, rod.insertion - reach, rod.insertion + reach);
    wanted.rotation = std::clamp(wanted.rotation, rod.rotation - turn, rod.rotation + turn);
    wanted.insertion = std::clamp(wanted.insertion, 0.0, longest_insertion(instrument));
    drive_position_ = recording_->add(simulator_->state().time + dt, wanted);
    inputs_.drive[0] = drive_position_;
}

const StepReport& Session::step() {
    if (single_steps_ > 0) --single_steps_;
    fade_effects();
    if (has_instrument()) follow_drive_command();
    inputs_.budget = status_.budget;
    (void)simulator_->step(inputs_); // all of them were checked as they came
    status_.stepped = true;
    const StepReport& report = simulator_->report();
    most_work_ = std::max(most_work_, report.work_units + (report.exact_ran || report.exact_forced ? refit_units(model_) : 0));
    if (!report.finite && recording_) recording_->spoil(Spoiler::Stopped);
    return report;
}

std::uint64_t Session::work_enough() const noexcept {
    std::uint64_t skin = 0;
    for (const InstrumentModel& instrument : model_.instruments) skin += instrument.topology.triangles.size();
    return std::clamp(std::max(kUnitsPerSkinTriangle * skin + refit_units(model_), 2 * most_work_), kLeastWork, kMostWork);
}

double Session::assumed_error_m() const noexcept {
    if (simulator_->report().exact_ran || !status_.stepped) return 0.0; // the exact answer stands in place of the spheres'
    double error = 0.0;
    for (const Contact& contact : simulator_->sphere_contacts()) {
        if (contact.origin != ContactOrigin::AssumedSpheres) continue;
        if (const Thing a = contact.a; !a.is_body()) { // a group of an instrument's links
            const double radius = simulator_->raw_state().instruments[a.index()].chain.spheres[contact.feature_a[0]].radius;
            error = std::max(error, 2.0 * (radius - model_.instruments[a.index()].rod.design.radius));
            continue;
        }
        for (const auto& [body, sphere] : {std::pair(contact.a, contact.feature_a[0]), std::pair(contact.b, contact.feature_b[0])})
            if (const spheretree::Sphere* known = simulator_->find_sphere(body.index(), sphere)) // anything within it may be what touches
                error = std::max(error, 2.0 * known->radius);
    }
    return error;
}

} // namespace trocar::engine::viewer
