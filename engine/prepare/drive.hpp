// Insertion and rotation of an instrument over time: the plain data that preparation fills and the script follows.
#pragma once

#include "base/vec.hpp"
#include "engine/scene/settings.hpp"

#include <span>
#include <vector>

namespace trocar::engine {

/// One row of a path: linear between rows, held before the first and after the last.
struct DriveRow {
    double time = 0.0;      // s, ascending
    double insertion = 0.0; // m
    double rotation = 0.0;  // rad
};

/// Wanted position of the handle at `time`. rows must not be empty.
[[nodiscard]] DriveCommand evaluate_path(std::span<const DriveRow> rows, double time) noexcept;

/// The lumen's middle from the port to the target.
struct Route {
    std::vector<Vec3> points;   // [n] m
    std::vector<double> radii;  // [n] m
    std::vector<double> length; // [n] m, arc length from the first point
};
[[nodiscard]] Route make_route(std::vector<Vec3> points, std::vector<double> radii);

} // namespace trocar::engine
