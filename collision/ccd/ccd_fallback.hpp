// CCD fallback for pairs that ccd.cpp could not decide four at a time: the step is swept (sweep.hpp), the contact that it comes to is
// proven, or the pair is decided in exact integer arithmetic.
#pragma once

#include "collision/ccd/ccd_result.hpp"
#include "collision/ccd/features.hpp"

#include <array>

namespace trocar::collision {

/// Coordinates that are not finite leave the pair unresolved, which counts as a contact at time 0.
[[nodiscard]] CcdResult run_ccd_fallback(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face);
[[nodiscard]] CcdResult run_ccd_fallback(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b);

} // namespace trocar::collision
