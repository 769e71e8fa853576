#include "python/binding/simulator.hpp"

#include "engine/scene/nearest.hpp"
#include "engine/step/checkpoint.hpp"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace trocar::python {

namespace {

constexpr std::chrono::milliseconds kPatience{200};

std::string no_such(const char* what, std::size_t found, std::size_t count) {
    return count == 0 ? fmt::format("found {} {}, but the scene has none", what, found)
                      : fmt::format("found {} {}, expected one from 0 to {}", what, found, count - 1);
}

} // namespace

class PySimulator::Use {
public:
    explicit Use(PySimulator& simulator) : simulator_(simulator) {
        while (!simulator_.mutex_.try_lock_for(kPatience))
            if (simulator_.user_process_.load() != getpid())
                bad_usage("this process was forked while another thread used the simulator; expected processes that are spawned, or a fork "
                          "between steps");
        simulator_.user_process_.store(getpid());
    }
    ~Use() { simulator_.mutex_.unlock(); }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

private:
    PySimulator& simulator_;
};

/// What does not move is projected once for each view.
struct PySimulator::Cameras {
    engine::FluoroscopySpec spec;
    engine::XrayPatient patient;
    std::vector<engine::Fluoroscope> scopes; // [views]

    Cameras(engine::FluoroscopySpec all, const engine::SceneModel& scene_model) : spec(std::move(all)), patient(spec, scene_model) {
        for (const engine::XrayView& view : spec.views) scopes.emplace_back(view);
    }
};

PySimulator::PySimulator(ScenePtr scene, const engine::BudgetLimits& limits)
    : scene_(std::move(scene)), limits_(limits), simulator_(scene_->take_simulator(limits)), drives_(model().instruments.size()),
      watched_(model().bodies.size()) {}

PySimulator::~PySimulator() { scene_->give_back(std::move(simulator_)); }

const engine::InstrumentState& PySimulator::instrument(std::size_t index) const {
    if (index >= model().instruments.size()) bad_usage(no_such("instrument", index, model().instruments.size()), "instrument");
    return simulator_->raw_state().instruments[index];
}

void PySimulator::drive(std::size_t index, std::optional<DriveRate> rate) {
    const Use use(*this);
    (void)instrument(index);
    if (rate)
        for (const auto& [key, value] : {std::pair("speed", rate->speed), std::pair("turn", rate->turn)})
            if (!std::isfinite(value))
                throw EngineError({ErrorCode::BadValue, fmt::format("found {:g}, expected a finite number", value), {}, 0, 0, key});
    drives_[index] = rate;
}

DriveRates PySimulator::drives() {
    const Use use(*this);
    return drives_;
}

void PySimulator::take_step(engine::Inputs& inputs) {
    const bool driven = std::any_of(drives_.begin(), drives_.end(), [](const auto& rate) { return rate.has_value(); });
    inputs.drive.resize(driven ? drives_.size() : 0);
    for (std::size_t i = 0; i < inputs.drive.size(); ++i) {
        inputs.drive[i].reset();
        if (!drives_[i]) continue;
        const fem::RodState& rod = simulator_->raw_state().instruments[i].rod;
        inputs.drive[i] = engine::DriveCommand{rod.insertion + drives_[i]->speed * model().step_s, rod.rotation + drives_[i]->turn * model().step_s};
    }
    check(simulator_->step(inputs));
}

engine::StepReport PySimulator::step(std::uint64_t count, const std::function<void()>& between) {
    for (std::uint64_t done = 0;;) {
        {
            const Use use(*this);
            if (!simulator_->report().finite && count > 0)
                throw StoppedError(fmt::format("stopped at step {}: {}; expected load() of an earlier state, or a new simulator",
                                               simulator_->raw_state().step, simulator_->report().failure));
            for (; done < count && simulator_->report().finite;) {
                take_step(inputs_);
                if (++done % kStepsBetween == 0) break;
            }
            if (any_watched_) follow_surfaces();
            if (done >= count || !simulator_->report().finite) return simulator_->report();
        }
        between();
    }
}

engine::StepReport PySimulator::report() {
    const Use use(*this);
    return simulator_->report();
}

std::uint64_t PySimulator::hash() {
    const Use use(*this);
    return hash_state(simulator_->state());
}

SavedState PySimulator::save() {
    const Use use(*this);
    return {scene_, std::make_shared<const engine::State>(simulator_->state()), drives_, {}};
}

void PySimulator::load(const SavedState& saved) {
    const Use use(*this);
    const auto wrong = [](std::string message) { throw EngineError({ErrorCode::BadValue, std::move(message), {}, 0, 0, "load"}); };
    if (saved.state) {
        if (saved.scene != scene_ && saved.scene->hash() != scene_->hash())
            wrong(fmt::format("the state is of another scene, \"{}\" ({:016x}); this one is \"{}\" ({:016x})", saved.scene->model().name,
                              saved.scene->hash(), model().name, scene_->hash()));
        check(simulator_->restore(*saved.state));
    } else {
        const auto checkpoint = engine::parse_checkpoint(saved.checkpoint, "saved state");
        if (!checkpoint.ok()) throw EngineError(checkpoint.error());
        if (checkpoint->model_hash != scene_->hash())
            wrong(fmt::format("the state is of another scene, \"{}\" ({:016x}); this one is \"{}\" ({:016x})", checkpoint->scene,
                              checkpoint->model_hash, model().name, scene_->hash()));
        check(engine::resume(*simulator_, *checkpoint, "saved state"));
    }
    if (saved.drives.size() == drives_.size()) drives_ = saved.drives;
    if (any_watched_) follow_surfaces();
}

std::unique_ptr<PySimulator> PySimulator::fork() {
    auto copy = std::make_unique<PySimulator>(scene_, limits_);
    const Use use(*this);
    check(copy->simulator_->restore(simulator_->raw_state()));
    copy->drives_ = drives_;
    return copy;
}

std::vector<Contact> PySimulator::contacts() {
    const Use use(*this);
    return {simulator_->contacts().begin(), simulator_->contacts().end()};
}

engine::Fluoroscope& PySimulator::find_scope(const std::string& name, const engine::State& state) {
    if (!cameras_) {
        engine::FluoroscopySpec spec = scene_->scene().outputs.fluoroscopy.value_or(engine::FluoroscopySpec{});
        if (spec.views.empty()) spec.views = {engine::XrayPatient::whole_view(model(), state, {256, 256})};
        auto made = std::make_unique<Cameras>(std::move(spec), model());
        for (const engine::XrayView& view : made->spec.views)
            if (const auto outside = made->patient.check_source(state, view); !outside) throw EngineError(outside.error());
        cameras_ = std::move(made);
    }
    std::string known;
    for (engine::Fluoroscope& scope : cameras_->scopes) {
        if (name.empty() || scope.view().name == name) return scope;
        known += (known.empty() ? "" : ", ") + scope.view().name;
    }
    bad_usage(fmt::format("found the view \"{}\", expected one of {}", name, known), "view");
}

engine::GreyFrame PySimulator::render(const std::string& name) {
    const Use use(*this);
    const engine::State& state = simulator_->state();
    engine::Fluoroscope& scope = find_scope(name, state);
    (void)scope.project(cameras_->patient, state);
    return scope.frame(state.step, state.time);
}

engine::XrayObservation PySimulator::observe(const std::string& name) {
    const Use use(*this);
    const engine::State& state = simulator_->state();
    engine::Fluoroscope& scope = find_scope(name, state);
    return engine::observe(scope, cameras_->patient, model(), state, state.step);
}

std::span<const Vec3> PySimulator::rod(std::size_t index) { return instrument(index).rod.position; }

std::span<const Vec3> PySimulator::skin(std::size_t index) { return instrument(index).skin; }

std::span<const Vec3> PySimulator::surface(std::size_t body) {
    if (body >= model().bodies.size()) bad_usage(no_such("body", body, model().bodies.size()), "body");
    const Use use(*this);
    if (!model().bodies[body].moves()) return simulator_->raw_state().bodies[body].surface;
    if (watched_[body].empty()) watched_[body] = simulator_->state().bodies[body].surface;
    any_watched_ = true;
    return watched_[body];
}

void PySimulator::follow_surfaces() {
    const engine::State& state = simulator_->state();
    for (std::size_t i = 0; i < watched_.size(); ++i)
        if (!watched_[i].empty()) std::copy(state.bodies[i].surface.begin(), state.bodies[i].surface.end(), watched_[i].begin());
}

} // namespace trocar::python
