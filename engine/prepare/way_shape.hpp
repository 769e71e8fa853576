// What a way through a lumen asks of an instrument's tip.
#pragma once

#include "base/vec.hpp"

#include <span>

namespace trocar::engine {

/// rad; a way that turns more at a place turns back.
inline constexpr double kTurnsBack = 2.1;

/// Of a way around one of its points, over three of the lumen's radii there before and behind it.
struct WayPlace {
    double turn = 0.0;                    // rad
    double narrowest = 0.0, widest = 0.0; // m, radii of the lumen
};

/// points  [n] m, radii [n] m, n > 0
[[nodiscard]] WayPlace measure_place(std::span<const Vec3> points, std::span<const double> radii, std::size_t at) noexcept;

/// m to the side, of a tip that is an arc of this length and bend at rest.
[[nodiscard]] double tip_reach(double length, double angle) noexcept;

} // namespace trocar::engine
