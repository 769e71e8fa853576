// Simulate only what a scene calls for: the time that leaving out each effect saves.
#include "bench/bench_scene.hpp"
#include "bench/tables.hpp"
#include "engine/experiments/effect_cost.hpp"
#include "engine/prepare/prepare_scene.hpp"

#include <algorithm>
#include <iterator>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kSteps = 300, kQuickSteps = 12;
/// Instruments that meet each other, one in another's bore, one with itself, and one with a solid.
constexpr const char* kMeetings[] = {"assets/scenes/two_devices.json", "assets/scenes/guidewire.json", "assets/scenes/coil.json", "assets/scenes/needle_and_liver.json"};

} // namespace

Result<BenchTable> bench_effects(const BenchOptions& options) {
    BenchTable table;
    std::vector<std::filesystem::path> files{"assets/scenes/hepatic.json", "assets/scenes/falling_sphere.json"};
    if (options.quick) files.erase(files.begin());
    else files.insert(files.end(), std::begin(kMeetings), std::end(kMeetings));
    if (!options.scene.empty()) files = {options.scene};
    for (const std::filesystem::path& file : files) {
        const auto ready = prepare_for_bench(file, options, table);
        if (!ready.ok()) return ready.error();
        const Scene& scene = ready->scene;
        const SceneModel& model = ready->prepared.model;
        const std::uint64_t steps = std::min(options.quick ? kQuickSteps : kSteps, model.step_count);
        const auto costs =
            measure_effects(model, steps, [&](const std::string& what) { options.progress(scene.name + " " + what); });
        for (const EffectCost& cost : costs)
            table.rows.push_back({{"scene", scene.name},
                                  {"effect", cost.effect->name},
                                  {"steps", steps},
                                  {"with_ms_p50", cost.with_ms},
                                  {"without_ms_p50", cost.without_ms},
                                  {"saved_ms", cost.saved_ms()},
                                  {"noise_ms", cost.noise_ms},
                                  {"saved_share", cost.with_ms > 0.0 ? cost.saved_ms() / cost.with_ms : 0.0},
                                  {"entered", cost.entered},
                                  {"entered_without", cost.entered_without}});
    }
    table.notes.push_back("with, without: median processor time of a step, both runs in turns; less than nothing is saved where an effect "
                          "spares the others work");
    table.notes.push_back("noise: twice the standard error of what is saved; less than that is below what can be measured");
    table.notes.push_back("entered: times that the effect's code was entered in the run with it, and in the run without it");
    return table;
}

} // namespace trocar::engine
