// Sphere trees from .sph files for surfaces that they may fit badly: checked, made whole, and what they lacked said.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "spheretree/build/adopt_tree.hpp"

#include <filesystem>
#include <string>

namespace trocar::engine {

/// From the file's coordinates to the surface's: scale x + translate.
struct SphereFrame {
    double scale = 1.0;            // m per unit of the file
    Vec3 translate = Vec3::Zero(); // m
};

/// surface  m, as the body starts
/// fails    as read_sph; BadValue with file and line where the tree is of another size or at another place than the surface, or has more than
///          two million spheres
[[nodiscard]] Result<spheretree::AdoptedTree> load_spheres(const std::filesystem::path& file, const SphereFrame& frame, const TriMesh& surface);

/// What the file's tree holds of the surface, and what was enlarged: a sentence with numbers.
[[nodiscard]] std::string describe_coverage(const std::filesystem::path& file, const spheretree::AdoptedTree& adopted);

} // namespace trocar::engine
