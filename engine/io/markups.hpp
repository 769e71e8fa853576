// 3D Slicer's Markups (.mrk.json): curves, closed curves and points, with a radius per control point where they have one.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace trocar::engine {

/// One node of a Markups file. Positions are right, anterior, superior (RAS), whatever the file's coordinate system.
struct Markup {
    std::string type = "Curve";      // Curve, ClosedCurve, Fiducial, ...
    std::string name;                // empty: the file says none
    std::vector<Vec3> points;        // [point_count] m
    std::vector<double> radii;       // [point_count] m, of the measurement Radius; empty: none
    std::vector<std::string> labels; // [point_count]
};

/// Control points whose status is not "defined" are passed over. Units are mm unless coordinateUnits says m, cm or um.
/// fails  with file and line, or file and key: broken JSON, a position without three finite numbers, as many radii as there are not
///        points, an unknown coordinate system or unit, more than kMostMarkupPoints points, no markup at all
[[nodiscard]] Result<std::vector<Markup>> read_markups(const std::filesystem::path& path);
inline constexpr std::size_t kMostMarkupPoints = 2'000'000;

/// In mm and RAS; all digits of every number.
[[nodiscard]] Result<void> write_markups(const std::filesystem::path& path, std::span<const Markup> markups);

} // namespace trocar::engine
