// Contrast agent in the blood, as pictures and curves ask for it.
#pragma once

#include "engine/state/state.hpp"

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace trocar::engine::effects {

/// kg, of iodine.
struct ContrastBalance {
    double injected = 0.0, in_vessels = 0.0, washed_out = 0.0;
};
/// All 0 where the scene has no contrast.
[[nodiscard]] ContrastBalance measure_contrast(const SceneModel& model, const State& state);

/// The scene's one injection.
struct Injection {
    double rate = 0.0;                   // m^3/s
    double iodine = 0.0;                 // kg/m^3, of the agent
    double start = 0.0, duration = 0.0;  // s
};
/// None where the model has no contrast.
[[nodiscard]] std::optional<Injection> find_injection(const SceneModel& model);
/// Between two steps: the steps after it inject as if the scene said so. Nothing where the model has no contrast.
void set_injection_start(SceneModel& model, double start);

/// Each piece of vessel: its two ends and its radius in metres, its iodine in kg/m^3, where the vessel stands now.
/// points    room for where that is
void visit_contrast(const SceneModel& model, const State& state, std::vector<Vec3>& points,
                    const std::function<void(const Vec3& from, const Vec3& to, double radius, double iodine)>& visit);

/// kg/m^3 of iodine in the vessel nearest to a place at rest.
[[nodiscard]] double find_iodine(const SceneModel& model, const State& state, const Vec3& rest_place);

/// What a step does to the concentrations: a conservative upwind scheme, implicit, in one pass from the inlet to the ends. Source and flow
/// are constant over the step.
/// iodine    [point_count] kg/m^3, of the piece between a point and the one before it; that of the inlet stays 0
/// flow      [point_count] m^3/s, through that piece
/// at, rate, injected   piece that is injected into, m^3/s, kg/m^3; rate 0: none
/// beat      [-] of the mean flow, at this time of the heart's beat
/// returns   kg, what has left by the ends
double advect(const BloodFlow& vessels, std::span<double> iodine, std::span<double> flow, double beat, std::size_t at, double rate, double injected,
              double step);

/// m^3, of the piece that ends at a point.
[[nodiscard]] double piece_volume(const BloodFlow& vessels, Index point) noexcept;

} // namespace trocar::engine::effects
