// All that one X-ray frame says of a state, as learning systems take it: the picture, masks, depth, and where the instruments are in it.
#pragma once

#include "engine/fluoroscopy/fluoroscope.hpp"

#include <array>
#include <vector>

namespace trocar::engine {

using PixelPlace = std::array<double, 2>; // u, v; NaN where the place does not lie before the source

struct XrayObservation {
    GreyFrame image;                 // as the view's display shows it
    GreyFrame device, vessel, depth; // as Fluoroscope's
    XrayProjection projection;
    ArmAngles angles;
    std::vector<PixelPlace> tips;                     // [instruments]
    std::vector<std::vector<PixelPlace>> centrelines; // [instruments][nodes that are inserted], the tip last
};

/// Projects.
/// frame    of which the noise follows
[[nodiscard]] XrayObservation observe(Fluoroscope& scope, XrayPatient& patient, const SceneModel& model, const State& state, std::uint64_t frame);

[[nodiscard]] PixelPlace place_in_picture(const XrayProjection& projection, const Vec3& point) noexcept;

} // namespace trocar::engine
