// Frames as one animated PNG (the APNG extension: browsers play it, other readers show its first frame).
#pragma once

#include "engine/fluoroscopy/detector.hpp"

#include "base/result.hpp"

#include <span>
#include <string>

namespace trocar::engine {

/// frames    of one size and depth
/// seconds   that each is shown
/// fails     BadValue: no frames, or of different sizes
[[nodiscard]] Result<std::string> encode_film(std::span<const GreyFrame> frames, double seconds);

} // namespace trocar::engine
