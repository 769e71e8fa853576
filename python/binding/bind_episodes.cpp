#include "engine/episodes/environment_batch.hpp"
#include "engine/episodes/rollout.hpp"
#include "engine/episodes/record.hpp"
#include "engine/time/clock.hpp"
#include "python/binding/arrays.hpp"
#include "python/binding/batch_answers.hpp"
#include "python/binding/bindings.hpp"
#include "python/binding/errors.hpp"
#include "python/binding/long_call.hpp"
#include "python/binding/loaded_scene.hpp"
#include "python/binding/pictures.hpp"
#include "python/binding/simulator.hpp"

#include <pybind11/stl.h>

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <mutex>
#include <utility>

namespace trocar::python {

namespace {

using TaskPtr = std::shared_ptr<const engine::Task>;

/// A task with the scene that it is of.
struct PyTask {
    ScenePtr scene;
    TaskPtr task;
};

/// Looks for a signal, no more often than anybody would notice: the interpreter's lock is taken for it.
class SignalCheck {
public:
    void operator()() {
        const std::int64_t now = engine::monotonic_ns();
        if (now - last_ < kBetween_ns) return;
        last_ = now;
        const py::gil_scoped_acquire held;
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }

private:
    static constexpr std::int64_t kBetween_ns = 20'000'000;
    std::int64_t last_ = engine::monotonic_ns();
};

/// One thread of Python at a time, in the process that made the pool's threads.
std::unique_lock<std::mutex> enter(std::mutex& mutex, const engine::ThreadPool& pool, const char* what) {
    if (pool.size() > 1 && !pool.is_of_this_process())
        bad_usage(fmt::format("this process was forked after the {} had started its threads, which it does not have; expected processes that "
                              "are spawned (multiprocessing.get_context(\"spawn\")), or a {} made after the fork",
                              what, what));
    std::unique_lock lock(mutex, std::try_to_lock);
    if (!lock) bad_usage(fmt::format("the {} is in use by another thread; expected one at a time", what));
    return lock;
}

void check_finite(const double* values, std::size_t count, std::size_t per_row) {
    for (std::size_t k = 0; k < count; ++k)
        if (!std::isfinite(values[k]))
            throw EngineError({ErrorCode::BadValue,
                               fmt::format("found {:g} in row {}, expected finite numbers; nothing was done", values[k], k / per_row), {}, 0, 0, "actions"});
}

PyTask make_task(const std::shared_ptr<LoadedScene>& scene, const py::dict& options) {
    engine::TaskOptions o;
    engine::visit_options(o, [&](const char* key, auto& value) { value = options[key].cast<std::remove_reference_t<decltype(value)>>(); });
    if (!options["budget"].is_none()) o.budget = value_of(engine::parse_budget(options["budget"].cast<std::string>())).limits;
    const auto made = std::make_shared<Result<TaskPtr>>(TaskPtr{});
    const ScenePtr kept = scene;
    run_long([=](const StopCheck& check_stop) {
        *made = engine::make_task(kept->scene(), {kept, &kept->prepared()}, o, [&](const std::string&) { check_stop(); });
    });
    return {kept, value_of(std::move(*made))};
}

/// Of "view", "pixels" (columns, rows), "channels"; none: no pictures, not even when they are asked for.
std::optional<engine::PixelOptions> pixel_options(const py::object& told) {
    if (told.is_none()) return std::nullopt;
    const py::dict given = told.cast<py::dict>();
    engine::PixelOptions options;
    options.view = given["view"].cast<std::string>();
    options.pixels = given["pixels"].cast<std::array<unsigned, 2>>();
    for (const int channel : given["channels"].cast<std::vector<int>>()) options.channels.push_back(static_cast<engine::PixelChannel>(channel));
    return options;
}

/// A camera for each environment and task, copied from one of each task.
std::vector<std::vector<engine::PixelCamera>> make_cameras(const std::vector<std::vector<PyTask>>& tasks, const std::optional<engine::PixelOptions>& options) {
    std::vector<std::vector<engine::PixelCamera>> all;
    if (!options) return all;
    std::vector<std::pair<TaskPtr, engine::PixelCamera>> made;
    const auto find = [&](const TaskPtr& task) { return std::find_if(made.begin(), made.end(), [&](const auto& one) { return one.first == task; }); };
    for (const auto& each : tasks) {
        std::vector<engine::PixelCamera>& own = all.emplace_back();
        for (const PyTask& one : each) {
            if (find(one.task) == made.end()) {
                auto camera = free([&] { return engine::PixelCamera::make(one.scene->scene(), one.scene->prepared(), *options); });
                made.emplace_back(one.task, value_of(std::move(camera)));
            }
            own.push_back(find(one.task)->second);
        }
    }
    return all;
}

std::array<py::ssize_t, 3> picture_of(const std::optional<engine::PixelOptions>& options) {
    if (!options) return {0, 0, 0};
    return {static_cast<py::ssize_t>(options->pixels[1]), static_cast<py::ssize_t>(options->pixels[0]), static_cast<py::ssize_t>(options->channels.size())};
}

class PyBatch {
public:
    PyBatch(std::vector<std::vector<PyTask>> tasks, unsigned threads, engine::Autoreset autoreset, bool copy, const std::optional<engine::PixelOptions>& pixels)
        : tasks_(std::move(tasks)), count_(static_cast<py::ssize_t>(tasks_.size())), has_cameras_(pixels.has_value()),
          answers_(count_, static_cast<py::ssize_t>(tasks_.front().front().task->observation_size()),
                   static_cast<py::ssize_t>(tasks_.front().front().task->devices()), picture_of(pixels), copy),
          batch_(std::make_unique<engine::EnvironmentBatch>(tasks_of(tasks_), threads, autoreset, engine::BatchArrays{}, make_cameras(tasks_, pixels))) {}
    ~PyBatch() {
        const py::gil_scoped_release released; // the pool's threads are joined
        batch_.reset();
    }
    PyBatch(const PyBatch&) = delete;
    PyBatch& operator=(const PyBatch&) = delete;

    /// returns   observations, infos
    py::tuple reset(const std::vector<std::optional<std::uint64_t>>& seeds, const std::vector<std::uint8_t>& mask) {
        const auto lock = enter(mutex_, batch_->pool(), "environments");
        BatchAnswers::Next next = answers_.next();
        batch_->write_to(answers_.pointers(next));
        {
            const py::gil_scoped_release released;
            batch_->reset(seeds, mask, SignalCheck());
        }
        answers_.take(next);
        return py::make_tuple(next.told[0], next.told[4]);
    }

    /// actions   (count, devices, 2) float64, contiguous, in this machine's byte order; of any other array nothing is done
    /// returns   observations, rewards, terminated, truncated, infos: a tuple; a list where pictures, failures or ends of episodes are to be added; none
    ///           where nothing was done
    py::object step(const py::object& actions) {
        const auto lock = enter(mutex_, batch_->pool(), "environments");
        if (!py::isinstance<py::array>(actions)) return py::none();
        const auto taken = py::reinterpret_borrow<py::array>(actions);
        const auto devices = static_cast<py::ssize_t>(batch_->devices());
        if ((taken.dtype().ptr() != double_.ptr() && !taken.dtype().equal(double_)) || (taken.flags() & py::array::c_style) == 0) return py::none();
        if (taken.ndim() != 3 || taken.shape(0) != count_ || taken.shape(1) != devices || taken.shape(2) != 2) return py::none();
        if (!batch_->ready()) bad_usage("the environments have no episode, or their last step was interrupted; expected reset() first");
        const std::span<const double> values(static_cast<const double*>(taken.data()), static_cast<std::size_t>(taken.size()));
        check_finite(values.data(), values.size(), 2 * batch_->devices());
        BatchAnswers::Next next = answers_.next();
        batch_->write_to(answers_.pointers(next));
        {
            const py::gil_scoped_release released;
            const engine::StopWatch watch;
            batch_->step(values, SignalCheck());
            engine_ms_ = watch.elapsed_ms();
        }
        answers_.take(next);
        if (has_cameras_ || batch_->has_more_to_tell()) return py::list(next.told);
        return std::move(next.told);
    }

    [[nodiscard]] SavedState save(std::size_t i) {
        const auto lock = enter(mutex_, batch_->pool(), "environments");
        const engine::Environment& environment = batch_->at(check_index(i));
        return {tasks_[i][environment.task_index()].scene, std::make_shared<const engine::State>(environment.simulator()->state()),
                DriveRates(environment.task().devices()), {}};
    }
    [[nodiscard]] py::list rods(std::size_t i) {
        const auto lock = enter(mutex_, batch_->pool(), "environments");
        py::list out;
        for (const auto& instrument : batch_->at(check_index(i)).simulator()->raw_state().instruments) out.append(copy_points(instrument.rod.position));
        return out;
    }
    /// All that an environment's picture says now.
    [[nodiscard]] py::dict xray(std::size_t i) {
        const auto lock = enter(mutex_, batch_->pool(), "environments");
        if (!has_cameras_) bad_usage("these environments have no camera; expected observation=\"pixels\" or \"both\", or a render_mode");
        if (!batch_->ready()) bad_usage("the environments have no episode; expected reset() first");
        (void)check_index(i);
        return picture_dict(free([&] { return batch_->observe_all(i); }));
    }
    [[nodiscard]] py::array observation() const { return answers_.observation(); }
    [[nodiscard]] py::array pixels() const { return answers_.pixels(); }
    [[nodiscard]] py::array tips() const { return answers_.tips(); }
    [[nodiscard]] py::array final_pixels() const { return answers_.final_pixels(); }
    [[nodiscard]] std::string failure(std::size_t i) const { return batch_->failure(check_index(i)); }
    [[nodiscard]] std::pair<std::string, std::string> episode(std::size_t i) {
        const engine::Environment& environment = batch_->at(check_index(i));
        return {tasks_[i][environment.task_index()].scene->scene().name, environment.task().targets[environment.target()].name};
    }

    [[nodiscard]] py::array final_observation() const { return answers_.final_observation(); }
    [[nodiscard]] py::array outcome() const { return answers_.outcome(); }
    [[nodiscard]] bool has_more_to_tell() const noexcept { return batch_->has_more_to_tell(); }
    [[nodiscard]] std::size_t devices() const { return batch_->devices(); }
    /// ms, of the last step without the interpreter's lock.
    [[nodiscard]] double engine_ms() const noexcept { return engine_ms_; }
    [[nodiscard]] py::ssize_t count() const noexcept { return count_; }

private:
    static std::vector<std::vector<TaskPtr>> tasks_of(const std::vector<std::vector<PyTask>>& tasks) {
        std::vector<std::vector<TaskPtr>> out;
        for (const auto& each : tasks) {
            out.emplace_back();
            for (const PyTask& one : each) out.back().push_back(one.task);
        }
        return out;
    }
    [[nodiscard]] std::size_t check_index(std::size_t i) const {
        if (i >= static_cast<std::size_t>(count_)) bad_usage(fmt::format("found environment {}, expected one from 0 to {}", i, count_ - 1), "index");
        return i;
    }

    std::vector<std::vector<PyTask>> tasks_;
    py::ssize_t count_;
    bool has_cameras_;
    BatchAnswers answers_;
    py::dtype double_ = py::dtype::of<double>(); // numpy's own
    std::unique_ptr<engine::EnvironmentBatch> batch_;
    double engine_ms_ = 0.0;
    std::mutex mutex_;
};

class PyRollout {
public:
    PyRollout(const std::shared_ptr<LoadedScene>& scene, unsigned threads)
        : scene_(scene), rollout_(std::make_unique<engine::Rollout>(scene->model(), scene->model().budget, threads)) {}
    ~PyRollout() {
        const py::gil_scoped_release released;
        rollout_.reset();
    }

    py::dict run(const std::vector<const SavedState*>& saved, const py::array_t<double, py::array::c_style>& actions, std::uint64_t steps, bool keep) {
        const auto lock = enter(mutex_, rollout_->pool(), "rollout");
        std::vector<const engine::State*> states;
        for (const SavedState* one : saved) {
            if (!one->state) bad_usage("a state that came from another process is known once a simulator has loaded it; expected load() first");
            if (one->scene != scene_ && one->scene->hash() != scene_->hash()) bad_usage("a state is of another scene than the rollout", "states");
            states.push_back(one->state.get());
        }
        check_finite(actions.data(), static_cast<std::size_t>(actions.size()), static_cast<std::size_t>(actions.shape(1) * actions.shape(2) * 2));
        const py::ssize_t n = actions.shape(0), t = actions.shape(1), d = actions.shape(2);
        py::array_t<double> tip({n, t, d, py::ssize_t{3}}), insertion({n, t, d}), rotation({n, t, d}), force({n, t});
        py::array_t<std::uint32_t> exits({n, t});
        py::array_t<std::uint64_t> hash(n), done(n);
        std::vector<std::shared_ptr<const engine::State>> final(keep ? states.size() : 0);
        const engine::RolloutArrays arrays{tip.mutable_data(), insertion.mutable_data(), rotation.mutable_data(), force.mutable_data(),
                                           exits.mutable_data(), hash.mutable_data(), done.mutable_data()};
        const std::span<const double> values(actions.data(), static_cast<std::size_t>(actions.size()));
        {
            const py::gil_scoped_release released;
            rollout_->run(states, values, static_cast<std::size_t>(t), steps, arrays, final, SignalCheck());
        }
        py::list final_states;
        for (const auto& state : final) final_states.append(SavedState{scene_, state, DriveRates(static_cast<std::size_t>(d)), {}});
        py::dict out;
        out["tip"] = tip, out["insertion"] = insertion, out["rotation"] = rotation, out["force"] = force, out["exits"] = exits;
        out["hash"] = hash, out["done"] = done, out["states"] = final_states;
        return out;
    }

private:
    ScenePtr scene_;
    std::unique_ptr<engine::Rollout> rollout_;
    std::mutex mutex_;
};

py::dict describe_task(const PyTask& task) {
    const engine::Task& t = *task.task;
    py::dict out;
    const auto size = static_cast<py::ssize_t>(t.observation_size());
    py::array_t<float> low(size), high(size);
    engine::find_observation_bounds(t, {low.mutable_data(), t.observation_size()}, {high.mutable_data(), t.observation_size()});
    py::list targets, limits;
    for (const auto& target : t.targets) targets.append(target.name);
    for (const auto& instrument : t.model().instruments) limits.append(py::make_tuple(instrument.limits.speed, instrument.limits.rotation));
    out["low"] = low, out["high"] = high, out["devices"] = t.devices(), out["targets"] = targets, out["limits"] = limits;
    out["steps_per_action"] = t.steps_per_action, out["action_limit"] = t.action_limit, out["step"] = t.model().step_s;
    out["budget"] = engine::BudgetSpec{t.budget}.to_string(), out["start_poses"] = t.starts.size();
    return out;
}

/// The centreline tree of the task's lumen.
py::dict tree_of(const PyTask& task) {
    const auto& tree = task.task->tree;
    py::array_t<std::int64_t> parents(static_cast<py::ssize_t>(tree.parents.size()));
    for (std::size_t i = 0; i < tree.parents.size(); ++i)
        parents.mutable_data()[i] = tree.parents[i] == kNoIndex ? -1 : static_cast<std::int64_t>(tree.parents[i]);
    py::dict out, remaining;
    for (const auto& target : task.task->targets)
        remaining[py::str(target.name)] = py::array_t<double>(static_cast<py::ssize_t>(target.remaining.size()), target.remaining.data());
    out["points"] = copy_points(tree.points), out["radii"] = py::array_t<double>(static_cast<py::ssize_t>(tree.radii.size()), tree.radii.data());
    out["parents"] = parents, out["remaining"] = remaining;
    return out;
}

/// s, of walking through memory: a call that does nothing else, and leaves the processor's caches as the work of many environments does.
double walk_memory(std::size_t megabytes) {
    const engine::StopWatch watch;
    static std::vector<double> memory; // under the interpreter's lock
    memory.resize(std::min<std::size_t>(megabytes, 1024) << 17);
    for (double& value : memory) value += 1.0;
    return 1e-3 * watch.elapsed_ms();
}

/// After the files that it vouches for.
void write_manifest_of(const PyTask& task, const std::string& folder, std::uint64_t seed, const std::vector<std::string>& files) {
    const auto& from = task.scene->source();
    check(engine::write_manifest(*task.task, {from.file, from.text, {}, from.anatomy_seed}, seed, files, folder));
}

} // namespace

void bind_episodes(py::module_& module) {
    py::class_<PyTask>(module, "Task", "Navigation in one scene: what its episodes share.")
        .def(py::init(&make_task))
        .def_property_readonly("scene", [](const PyTask& t) { return std::const_pointer_cast<LoadedScene>(t.scene); })
        .def("describe", &describe_task)
        .def("tree", &tree_of)
        .def("write_manifest", &write_manifest_of);
    py::class_<PyBatch>(module, "Batch", "Environments side by side on a pool of threads.")
        .def(py::init([](const std::vector<std::vector<PyTask>>& tasks, unsigned threads, int autoreset, bool copy, const py::object& pixels) {
            return std::make_unique<PyBatch>(tasks, threads, static_cast<engine::Autoreset>(autoreset), copy, pixel_options(pixels));
        }))
        .def("reset", &PyBatch::reset)
        .def("step", &PyBatch::step)
        .def("save", &PyBatch::save)
        .def("rods", &PyBatch::rods)
        .def("xray", &PyBatch::xray)
        .def_property_readonly("observation", &PyBatch::observation)
        .def_property_readonly("pixels", &PyBatch::pixels)
        .def_property_readonly("tips", &PyBatch::tips)
        .def_property_readonly("final_pixels", &PyBatch::final_pixels)
        .def("failure", &PyBatch::failure)
        .def("episode", &PyBatch::episode)
        .def_property_readonly("has_more_to_tell", &PyBatch::has_more_to_tell)
        .def_property_readonly("final_observation", &PyBatch::final_observation)
        .def_property_readonly("outcome", &PyBatch::outcome)
        .def_property_readonly("devices", &PyBatch::devices)
        .def_property_readonly("engine_ms", &PyBatch::engine_ms)
        .def("__len__", &PyBatch::count);
    module.def("walk_memory", &walk_memory);
    module.def("hash_bytes", [](const py::bytes& bytes) { return engine::hash_file_bytes(std::string_view(bytes)); });
    py::class_<PyRollout>(module, "Rollout", "Sequences of drive commands from many states, on a pool of threads.")
        .def(py::init<const std::shared_ptr<LoadedScene>&, unsigned>())
        .def("run", &PyRollout::run);
}

} // namespace trocar::python
