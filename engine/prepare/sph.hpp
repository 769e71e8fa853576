// Sphere trees as the Bradshaw & O'Sullivan toolkit writes them (.sph): "LEVELS DEGREE", then a line "x y z radius occupancy" per
// place of the full tree, level by level, the children of place n at n * DEGREE + 1 and on. Empty places have radius -1.
#pragma once

#include "base/result.hpp"
#include "spheretree/sphere_tree.hpp"

#include <filesystem>

namespace trocar::engine {

/// scale  multiplies coordinates and radii: from metres to the unit that the file is to have
/// fails  BadValue where the full tree would have more than 20 million places; CannotWrite as write_file_atomically
[[nodiscard]] Result<void> write_sph(const std::filesystem::path& path, const spheretree::SphereTree& tree, double scale = 1.0);

/// Reads what the toolkit or write_sph wrote; columns after the radius are passed over. Spheres beneath an empty place are
/// refused. The tree has no items: a file holds no triangles.
/// fails  with file and line: broken syntax, numbers that are not finite, too few lines, no root
[[nodiscard]] Result<spheretree::SphereTree> read_sph(const std::filesystem::path& path, double scale = 1.0);

} // namespace trocar::engine
