// What is made from a scene's numbers or from a surface alone is kept in the cache (cache.hpp): the hundredth run of a sweep
// and the second run of anybody read it.
#pragma once

#include "assets/anatomy/recipe.hpp"
#include "base/mesh.hpp"
#include "base/result.hpp"
#include "spheretree/lumen/centreline.hpp"
#include "spheretree/lumen/lumen_tree.hpp"

#include <span>

namespace trocar::engine {

/// anatomy::make_vessels, the same bits, from the cache where it was made before. Errors are not kept.
[[nodiscard]] Result<TriMesh> make_or_read_vessels(std::span<const anatomy::VesselBranch> branches, double blend, std::size_t triangles);

/// spheretree::build_lumen_tree with its default options, the same bits, from the cache where it was made before.
[[nodiscard]] Result<spheretree::LumenTree> make_or_read_lumen_tree(const TriMesh& closed_lumen);

/// spheretree::find_centreline_tree with its default options, likewise.
/// lumen  of make_or_read_lumen_tree: its wall tells which it is
[[nodiscard]] Result<spheretree::CentrelineTree> make_or_read_centreline(const spheretree::LumenTree& lumen, const Vec3& root);

} // namespace trocar::engine
