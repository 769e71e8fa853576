#include "engine/step/solid/soften_springs.hpp"

#include "engine/prepare/body_pairs.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

void find_scales(const SceneModel& model, std::size_t body, State& state, SolidScratch& solids) {
    BodyState& own = state.bodies[body];
    SolidBodyScratch& scratch = solids.bodies[body];
    scratch.spring_scale.clear();
    if (!model.bodies[body].tissue || own.springs.springs.empty() || !(own.stable.rates.elastic > 0.0)) return;
    fem::find_spring_scales(*model.bodies[body].tissue, own.springs, kMostAdded * own.stable.rates.elastic, own.stable,
                            scratch.spring_scale);
}

double scale_of(const SceneModel& model, std::size_t body, Index spring, const SolidScratch& solids) {
    if (spring == kNoIndex) return 1.0;
    const std::vector<double>& scales = solids.bodies[owner_of(model, body)].spring_scale;
    return scales.empty() ? 1.0 : scales[spring];
}

fem::ContactSpring& spring_at(const SceneModel& model, std::size_t body, Index spring, State& state) {
    return state.bodies[owner_of(model, body)].springs.springs[spring];
}

} // namespace

void soften_springs(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report) {
    if (state.solids.springs.empty()) return;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) find_scales(model, i, state, solids);
    for (const SpringPair& pair : state.solids.springs) {
        const double scale =
            std::min(scale_of(model, pair.body_a, pair.spring_a, solids), scale_of(model, pair.body_b, pair.spring_b, solids));
        if (!(scale < 1.0)) continue;
        ++report.softened;
        for (const auto& [body, index] : {std::pair(pair.body_a, pair.spring_a), std::pair(pair.body_b, pair.spring_b)}) {
            if (index == kNoIndex) continue;
            fem::ContactSpring& spring = spring_at(model, body, index, state);
            spring.stiffness *= scale;
            spring.damping *= scale;
        }
    }
}

} // namespace trocar::engine
