// What a scene pulls on its bodies and on the tips of its instruments with: forces, torques, tractions, pressures, accelerations and springs to the ground, by factors over time.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/state/state.hpp"
#include "fem/tissue/integration.hpp"
#include "fem/tissue/springs.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine::effects {

/// Adds a force on faces or nodes, or its rate.
static void push(const BodyLoad& load, double factor, const fem::TissueModel& tissue, std::vector<Vec3>& force) {
    force.resize(tissue.node_count(), Vec3::Zero());
    for (std::size_t f = 0; f < load.faces.size(); ++f)
        for (const Index node : load.faces[f]) force[node] += factor / 3.0 * Vec3(load.area[f] * load.vector);
    for (std::size_t k = 0; k < load.nodes.size(); ++k)
        force[load.nodes[k]] += factor * (load.kind == LoadKind::Force ? load.share[k] : tissue.node_mass[load.nodes[k]]) * load.vector;
}

static LoadLine factor_over(const std::vector<LoadRow>& rows, const EffectStep& step) {
    return rows.empty() ? LoadLine{} : fit_rows(rows, step.time_t1 - step.model.step_s, step.time_t1);
}

/// A spring pushes one way only: two of them along every axis hold. Between the factors at the step's start and end, which are not negative, it goes linearly.
static void hold_nodes(const BodyLoad& load, const EffectStep& step, const fem::TissueModel& tissue, fem::ContactSprings& springs) {
    const double first = load.over.empty() ? 1.0 : evaluate_rows(load.over, step.time_t1 - step.model.step_s);
    const double last = load.over.empty() ? 1.0 : evaluate_rows(load.over, step.time_t1), most = std::max(first, last);
    if (!(most > 0.0)) return;
    for (std::size_t k = 0; k < load.nodes.size(); ++k)
        for (int axis = 0; axis < 3; ++axis)
            for (const double way : {1.0, -1.0}) {
                fem::ContactSpring spring;
                spring.first_entry = static_cast<Index>(springs.entries.size());
                spring.entry_count = 1;
                spring.stiffness = most * load.number * load.share[k];
                spring.share = first / most;
                spring.share_rate = (last - first) / most / step.model.step_s;
                spring.offset = -way * tissue.rest_position[load.nodes[k]][axis];
                springs.entries.push_back({load.nodes[k], way * Vec3::Unit(axis)});
                springs.springs.push_back(spring);
            }
}

static void load_body(const EffectStep& step, std::size_t body, const State&, TissueLoads& acting) {
    const BodyModel& model = step.model.bodies[body];
    if (!step.live.loads || model.loads.empty()) return;
    step.counts.note(effects::loads);
    const fem::TissueModel& tissue = *model.tissue;
    for (const BodyLoad& load : model.loads) {
        if (load.kind == LoadKind::Spring) {
            hold_nodes(load, step, tissue, acting.springs);
            continue;
        }
        const auto [first, rate] = factor_over(load.over, step);
        if (load.kind == LoadKind::Pressure) {
            for (const Triangle& face : load.faces) acting.pressures.push_back({face, first * load.number, rate * load.number});
            continue;
        }
        push(load, first, tissue, acting.force);
        if (rate != 0.0) push(load, rate, tissue, acting.force_rate);
    }
}

static bool is_loaded(const InstrumentModel& instrument) { return instrument.tip_force != Vec3::Zero() || instrument.tip_torque != 0.0; }

static void load_tip(const EffectStep& step, std::size_t index, State&, RodLoads& acting) {
    const InstrumentModel& instrument = step.model.instruments[index];
    if (!step.live.loads || !is_loaded(instrument)) return;
    step.counts.note(effects::loads);
    const auto [first, rate] = factor_over(instrument.tip_over, step);
    acting.tip.force += first * instrument.tip_force, acting.tip.force_rate += rate * instrument.tip_force;
    acting.tip.torque += first * instrument.tip_torque, acting.tip.torque_rate += rate * instrument.tip_torque;
}

static std::size_t count_loads(const SceneModel& model) {
    std::size_t count = 0;
    if (model.effects.elasticity)
        for (const BodyModel& body : model.bodies) count += body.loads.size();
    for (const InstrumentModel& instrument : model.instruments) count += is_loaded(instrument);
    return count;
}

const EffectDescriptor loads{
    .name = "loads",
    .label = "loads",
    .doc = "Forces, tractions, pressures and springs of the bodies' key loads, and forces and torques on instruments' tips.",
    .acts_on = [](const SceneModel& model) { return model.effects.loads && count_loads(model) > 0; },
    .remove =
        [](SceneModel& model) {
            model.effects.loads = false;
            for (BodyModel& body : model.bodies) body.loads.clear();
            for (InstrumentModel& instrument : model.instruments) instrument.tip_force.setZero(), instrument.tip_torque = 0.0, instrument.tip_over.clear();
        },
    .explain = [](const Scene& scene, const SceneModel& model) -> EffectLine {
        if (!scene.effects.loads) return {false, listed(false, {})};
        const std::size_t count = count_loads(model);
        if (count > 0) return {true, fmt::format("{} of them", count)};
        const bool still = std::any_of(model.bodies.begin(), model.bodies.end(), [](const BodyModel& body) { return !body.loads.empty(); });
        return {false, still ? "without the effect elasticity no body moves" : "no body and no instrument has any"};
    },
    .scale =
        [](EffectSet& live, double share) {
            if (!(share > 0.0)) live.loads = false;
        },
    .load_tissue = load_body,
    .load_rod = load_tip,
};

} // namespace trocar::engine::effects
