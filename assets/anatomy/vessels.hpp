// A vessel tree of any shape as one closed lumen surface: axes with radii that melt into one another where they meet.
#pragma once

#include "assets/anatomy/recipe.hpp"
#include "base/mesh.hpp"
#include "base/result.hpp"

#include <span>
#include <vector>

namespace trocar::anatomy {

/// blend      m, width of the fillet where branches meet; 0: sharp
/// triangles  of the surface, aimed at
/// returns    closed, manifold, oriented outwards, one piece; ends are rounded
/// fails      BadValue: an axis whose neighbouring points coincide, a radius that is not positive, a tree that is too fine for
///            its size; BadMesh: the branches do not form one piece
[[nodiscard]] Result<TriMesh> make_vessels(std::span<const VesselBranch> branches, double blend, std::size_t triangles);

} // namespace trocar::anatomy
