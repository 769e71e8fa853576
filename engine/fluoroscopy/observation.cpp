#include "engine/fluoroscopy/observation.hpp"

#include <limits>

namespace trocar::engine {

PixelPlace place_in_picture(const XrayProjection& projection, const Vec3& point) noexcept {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    return project(projection, point).value_or(PixelPlace{kNone, kNone});
}

XrayObservation observe(Fluoroscope& scope, XrayPatient& patient, const SceneModel& model, const State& state, std::uint64_t frame) {
    const XrayFrame& now = scope.project(patient, state);
    XrayObservation out;
    out.projection = now.beam.projection();
    out.angles = now.angles;
    out.image = scope.frame(frame, state.time);
    out.device = scope.device_mask();
    out.vessel = scope.vessel_mask(patient, state);
    out.depth = scope.depth(patient, state);
    for (std::size_t i = 0; i < state.instruments.size(); ++i) {
        const fem::RodState& rod = state.instruments[i].rod;
        out.tips.push_back(place_in_picture(out.projection, rod.position.back()));
        std::vector<PixelPlace>& line = out.centrelines.emplace_back();
        for (Index n = fem::first_inserted_node(model.instruments[i].rod, rod.insertion); n < rod.position.size(); ++n)
            line.push_back(place_in_picture(out.projection, rod.position[n]));
    }
    return out;
}

} // namespace trocar::engine
