// Tissue deforms. It is a stage of the step: engine/step/tissue.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

#include <fmt/format.h>

namespace trocar::engine::effects {

const EffectDescriptor elasticity{
    .name = "elasticity",
    .label = "tissue yields",
    .doc = "Deformable bodies deform; off, they stay at rest.",
    .acts_on = [](const SceneModel& model) { return model.effects.elasticity && any_body(model, deforms); },
    .remove = [](SceneModel& model) { model.effects.elasticity = false; },
    .explain = [](const Scene& scene, const SceneModel& model) -> EffectLine {
        std::size_t bodies = 0, tets = 0;
        for (const BodyModel& body : model.bodies) {
            bodies += body.tissue.has_value();
            tets += body.tissue ? body.tissue->tet_nodes.size() : 0;
        }
        const bool on = scene.effects.elasticity;
        if (bodies == 0) return {false, kNothingDeforms};
        std::size_t implicit = 0, joined = 0;
        for (const BodyModel& body : model.bodies) {
            implicit += body.implicit.has_value();
            joined += !body.tied.empty() && !body.implicit;
        }
        std::string integrator = model.integrator == fem::Integrator::Rk4 ? "Runge-Kutta 4" : "leapfrog";
        if (implicit == bodies) integrator = "implicit";
        if (implicit > 0 && implicit < bodies) integrator += fmt::format(", {} of them implicit", implicit);
        if (joined > 0 && model.integrator == fem::Integrator::Rk4) integrator += fmt::format(", {} of them joined and by leapfrog", joined);
        return {on, listed(on, fmt::format("{} bodies, {} tetrahedra, {}", bodies, tets, integrator))};
    },
    .scale = [](EffectSet& live, double share) { live.elasticity = live.elasticity && share > 0.0; },
};

} // namespace trocar::engine::effects
