#include "engine/experiments/cost_exact.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

/// States of the exact run that are kept to be compared with: this many, or as many as this memory holds.
constexpr std::uint64_t kMostStates = 40, kFewestStates = 4;
constexpr std::uint64_t kStateBytes = std::uint64_t{256} << 20;

std::vector<Vec3> tips_of(const State& state) {
    std::vector<Vec3> tips;
    for (const InstrumentState& instrument : state.instruments) tips.push_back(instrument.rod.position.back());
    return tips;
}

std::uint64_t states_kept(const SceneModel& model) {
    std::uint64_t bytes = 1;
    for (const BodyModel& body : model.bodies) bytes += body.moves() ? sizeof(Vec3) * body.surface.vertices.size() : 0;
    for (const InstrumentModel& instrument : model.instruments) bytes += sizeof(Vec3) * instrument.skin.vertex_count();
    return std::clamp(kStateBytes / bytes, kFewestStates, kMostStates);
}

} // namespace

Shape shape_of(const SceneModel& model, const State& state) {
    Shape shape;
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (model.bodies[i].moves()) shape.surfaces.push_back(state.bodies[i].surface);
    for (const InstrumentState& instrument : state.instruments) shape.skins.push_back(instrument.skin);
    return shape;
}

SurfaceDistance compare_shapes(const SceneModel& model, const Shape& shape, const Shape& exact) {
    SurfaceDistance distance;
    std::size_t k = 0;
    for (const BodyModel& body : model.bodies) {
        if (!body.moves()) continue;
        distance.join(measure_distance(body.surface.triangles, shape.surfaces[k], exact.surfaces[k]));
        ++k;
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        distance.join(measure_distance(model.instruments[i].skin.triangles, shape.skins[i], exact.skins[i]));
    return distance;
}

Result<void> restore_variant(Simulator& simulator, const State& state, const SceneModel& scene) {
    const ContactSpec &own = simulator.model().contact, &its = scene.contact;
    const bool other_trees = own.sphere_trees != its.sphere_trees, other_response = own.solid_response != its.solid_response;
    if (!other_trees && !other_response) return simulator.restore(state);
    State known = state;
    if (other_trees) known.solids.touching.clear();
    if (other_response) known.solids.entries.clear(), known.solids.contacts.clear();
    return simulator.restore(known);
}

State run_to_start(const SceneModel& model, const CostOptions& options) {
    Simulator simulator(model, BudgetLimits{});
    for (std::uint64_t k = 0; k < options.from && !options.interrupted(); ++k) {
        options.progress(fmt::format("exact run to where the compared stretch begins, step {}/{}", k + 1, options.from));
        if (!simulator.step().finite) break;
    }
    return simulator.state();
}

bool go_to_start(Simulator& simulator, const CostOptions& options, const SceneModel& scene) {
    return options.start == nullptr || restore_variant(simulator, *options.start, scene).ok();
}

ExactRun run_exactly(const SceneModel& model, const CostOptions& options) {
    ExactRun run;
    run.every = std::max<std::uint64_t>(1, options.steps / states_kept(model));
    std::uint64_t most_pairs = 0;
    Simulator simulator(model, BudgetLimits{});
    if (!go_to_start(simulator, options, model)) {
        run.failure = kForeignStart;
        return run;
    }
    for (std::uint64_t k = 0; k < options.steps && !options.interrupted(); ++k) {
        const StepReport& report = simulator.step();
        options.progress(fmt::format("exact run, step {}/{}", k + 1, options.steps));
        run.failure = report.failure;
        if (!report.finite) break;
        ++run.steps;
        if (run.busiest_step == 0 || report.pairs_tested > most_pairs) {
            most_pairs = report.pairs_tested;
            run.busiest_step = run.steps;
        }
        run.tips.push_back(tips_of(simulator.state()));
        if (run.steps % run.every == 0) run.shapes.push_back(shape_of(model, simulator.state()));
    }
    return run;
}

double tip_distance(const State& state, const std::vector<Vec3>& exact) {
    double farthest = 0.0;
    for (std::size_t i = 0; i < exact.size(); ++i)
        farthest = std::max(farthest, (state.instruments[i].rod.position.back() - exact[i]).norm());
    return farthest;
}

} // namespace trocar::engine
