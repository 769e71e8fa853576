// VMTK's centrelines: lines of a .vtp with a radius per point and numbers per line.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"

#include <filesystem>
#include <vector>

namespace trocar::engine {

/// Coordinates and radii in the file's own unit. Arrays that the file does not have are empty.
struct LineMesh {
    std::vector<Vec3> points;
    std::vector<std::vector<Index>> lines; // point ids
    std::vector<double> radii;             // [point] MaximumInscribedSphereRadius
    std::vector<double> groups, centrelines, tracts, blanking; // [line] GroupIds, CenterlineIds, TractIds, Blanking
};

/// fails  as read_surface; BadValue: no line, an array whose length does not fit, a radius that is negative or not finite, a line that comes
///        back to a point that it has passed
[[nodiscard]] Result<LineMesh> read_centreline_lines(const std::filesystem::path& path);

} // namespace trocar::engine
