// The rest shape of a shaped tip as arcs: what they turn by, the line that they draw, and arcs of a line of points.
#pragma once

#include "base/vec.hpp"
#include "fem/rod/rod_design.hpp"

#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace trocar::fem {

/// rad about the first and the second axis across the rod, in a frame that is carried along without twist.
/// from, to  m from the shaped part's root, from <= to; beyond its ends nothing turns
[[nodiscard]] std::array<double, 2> turn_of_arcs(std::span<const TipArc> arcs, double from, double to) noexcept;

/// rad, of such a turn.
[[nodiscard]] inline double size_of(const std::array<double, 2>& turn) noexcept { return std::sqrt(turn[0] * turn[0] + turn[1] * turn[1]); }

/// Arcs of a line that is given by close points: each corner becomes a short arc. The shaft goes on in the direction of the first piece; plane 0
/// is the side on which the last point lies.
/// line  [3 or more] m, from the shaft's end to the tip; each apart from the one before
[[nodiscard]] std::vector<TipArc> arcs_along(std::span<const Vec3> line);

/// Where the arcs lead, starting along z with x as the frame's first axis.
/// Returns  [count + 1] m, at evenly spaced arc lengths, the root first
[[nodiscard]] std::vector<Vec3> draw_arcs(std::span<const TipArc> arcs, std::size_t count);

} // namespace trocar::fem
