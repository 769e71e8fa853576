// The cross-section of an instrument: a rod, a tube, or layers.
#pragma once

#include "engine/scene/scene.hpp"
#include "fem/rod/rod_model.hpp"

namespace trocar::engine {

/// The instrument's design as the rod is built of it: the solid circular section that bends and weighs as its tube or layers do, with the
/// factors by which they differ from it in stretch and rotary inertia. A solid instrument of one material is left as it is.
[[nodiscard]] fem::RodDesign solid_section(const SceneInstrument& instrument);

/// N m^2, E I of the shaft and of the last place that bends.
struct Bending {
    double shaft = 0.0, tip = 0.0;
};
[[nodiscard]] Bending find_bending(const fem::RodModel& rod) noexcept;

} // namespace trocar::engine
