#include "bench/hard_long_runs.hpp"

#include "bench/hard_scenes.hpp"
#include "engine/time/clock.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <unistd.h>

namespace trocar::engine {

namespace {

constexpr double kMinutes = 10.0;
constexpr int kHeapTriangles = 40; // of a ball's simplified surface, which its lattice follows
constexpr double kHeapStep = 0.01; // s

/// Resident memory, MiB. Linux.
double resident_mib() {
    std::ifstream file("/proc/self/statm");
    std::uint64_t total = 0, resident = 0;
    file >> total >> resident;
    return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

struct Second {
    double time_s, energy_j, memory_mib, step_ms;
};

/// A row of averages over each second.
std::vector<Second> run_long(const BenchOptions& options, const std::string& name, const SceneModel& model, std::string& stopped) {
    Simulator simulator(model);
    const auto steps = static_cast<std::uint64_t>(60.0 * kMinutes / model.step_s);
    const auto a_second = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(1.0 / model.step_s + 0.5));
    std::vector<Second> seconds;
    std::vector<double> times;
    seconds.reserve(steps / a_second + 1); // the bench itself must not grow
    times.reserve(a_second);
    for (std::uint64_t k = 1; k <= steps; ++k) {
        const StepReport& report = simulator.step();
        if (!report.finite) {
            stopped = report.failure;
            break;
        }
        times.push_back(report.ms.total);
        if (k % a_second != 0) continue;
        seconds.push_back({report.time_s, energy_of(simulator), resident_mib(), median(times)});
        times.clear();
        if (seconds.size() % 10 == 0) options.progress(fmt::format("{}: {:.0f} of {:.0f} s", name, report.time_s, 60.0 * kMinutes));
    }
    return seconds;
}

double mean_of(const std::vector<Second>& seconds, std::size_t from, std::size_t to, double Second::*value) {
    double sum = 0.0;
    for (std::size_t k = from; k < to; ++k) sum += seconds[k].*value;
    return to > from ? sum / static_cast<double>(to - from) : 0.0;
}

/// The second minute against the last: what settles has settled by then.
void add_rows(const std::string& name, const std::vector<Second>& seconds, const std::string& stopped, BenchTable& table) {
    struct Curve {
        const char *what, *unit;
        double Second::*value;
        double bound; // of the last minute over the second
        bool both;    // the other way round as well: energy that is lost for ever is a drift too
    };
    for (const Curve& curve :
         {Curve{"energy", "J", &Second::energy_j, 1.05, true}, Curve{"memory", "MiB", &Second::memory_mib, 1.02, false},
          Curve{"median step", "ms", &Second::step_ms, 1.5, false}}) {
        const std::size_t count = seconds.size(), minute = std::min<std::size_t>(60, count / 4);
        const double early = mean_of(seconds, minute, 2 * minute, curve.value), late = mean_of(seconds, count - minute, count, curve.value);
        const double ratio = curve.both ? std::max(late / early, early / late) : late / early;
        BenchRow& row = table.rows.emplace_back();
        row["group"] = "long runs";
        row["case"] = name;
        row["what"] = fmt::format("{}, last minute over the second{} ({:.4g} to {:.4g} {})", curve.what,
                                  curve.both ? ", or the other way round" : "", early, late, curve.unit);
        row["measured"] = std::isfinite(ratio) ? ratio : 0.0;
        row["relation"] = "<";
        row["bound"] = curve.bound;
        row["holds"] = stopped.empty() && early > 0.0 && late > 0.0 && ratio < curve.bound;
    }
    if (!stopped.empty()) table.notes.push_back(fmt::format("{} stopped: {}", name, stopped));
}

void add_plots(const std::string& name, const std::string& file, const std::vector<Second>& seconds, BenchTable& table) {
    std::string text;
    for (const Second& s : seconds) text += fmt::format("{} {} {} {}\n", s.time_s, s.energy_j, s.memory_mib, s.step_ms);
    table.plot_data.push_back({file, std::move(text)});
    struct Curve {
        const char *what, *label;
        double Second::*value;
        int column;
    };
    for (const Curve& curve : {Curve{"energy", "energy [J]", &Second::energy_j, 2}, Curve{"memory", "memory [MiB]", &Second::memory_mib, 3},
                               Curve{"step", "step, median of a second [ms]", &Second::step_ms, 4}}) {
        const auto [least, most] =
            std::minmax_element(seconds.begin(), seconds.end(), [&](const Second& a, const Second& b) { return a.*curve.value < b.*curve.value; });
        if (seconds.empty() || (*least).*curve.value == (*most).*curve.value) continue; // the table has what does not change
        Sketch sketch;
        sketch.plot = {std::string(curve.what) + file.substr(0, file.find('.')), fmt::format("{}: {}", name, curve.what),
                       "Ten minutes of simulated time, one point for each second.", ""};
        sketch.commands = fmt::format("set xlabel 'simulated time [s]'\nset ylabel '{}'\nset key off\nplot '{}' using 1:{} with lines\n",
                                      curve.label, file, curve.column);
        table.sketches.push_back(std::move(sketch));
    }
}

Result<void> add_long_run(const BenchOptions& options, const std::string& name, const std::string& file, const Result<Scene>& scene,
                          BenchTable& table) {
    if (!scene.ok()) return scene.error();
    const auto prepared = make_prepared_scene(*scene, [&](const std::string& what) { options.progress("preparing " + what); });
    if (!prepared.ok()) return prepared.error();
    std::size_t tets = 0;
    for (const BodySummary& body : prepared->bodies) tets += body.coarse_tets;
    table.notes.push_back(fmt::format("{}: {} tetrahedra, steps of {:g} ms", name, tets, 1e3 * prepared->model.step_s));
    std::string stopped;
    const std::vector<Second> seconds = run_long(options, name, prepared->model, stopped);
    add_rows(name, seconds, stopped, table);
    add_plots(name, file, seconds, table);
    return {};
}

} // namespace

Result<void> add_long_runs(const BenchOptions& options, BenchTable& table) {
    Result<Scene> scene = read_scene(options.scene.empty() ? "assets/scenes/hepatic.json" : options.scene);
    if (scene.ok()) scene->budget.limits = {BudgetMode::Work, 0.0, 20'000};
    if (auto done = add_long_run(options, scene.ok() ? scene->name : "", "scene.txt", scene, table); !done.ok()) return done;
    // of coarser tissue and longer steps than the hard cases have, so that it ends
    const std::string heap = solid_scene(
        {.bodies = heap_bodies(16, kHeapTriangles), .budget = "work:2000", .contact = R"("solid_friction": 0.2)", .step = kHeapStep});
    return add_long_run(options, "heap of 16 bodies", "heap.txt", parse_scene(heap, "heap.json"), table);
}

} // namespace trocar::engine
