// An X-ray frame for people: with the letters of the patient's sides and the cube.
#pragma once

#include "engine/fluoroscopy/detector.hpp"

namespace trocar::engine {

/// beam   of the frame
[[nodiscard]] GreyFrame lettered_frame(const GreyFrame& frame, const ConeBeam& beam);

} // namespace trocar::engine
