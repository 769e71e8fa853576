// The middle of a vessel as branches: from the inlet into every branch, each with radii, an id and the branch that it leaves.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/importing/openings.hpp"
#include "spheretree/lumen/lumen_tree.hpp"

#include <span>
#include <vector>

namespace trocar::engine {

/// Its id is its place in the list. Point 0 lies on the branch that it leaves, where it leaves it.
struct CentrelineBranch {
    std::vector<Vec3> points;     // [point_count] m
    std::vector<double> radii;    // [point_count] m, of the largest inscribed sphere about the point: its distance to the wall
    Index parent = kNoIndex;      // branch
    bool ends = true;             // no other branch goes on from its last point
};

enum class Centring : std::uint8_t {
    Full, // points in the middle, radii by the wall
    None, // as the lumen's spheres give them: to see which branches there are
};

/// closed   the lumen tree's surface
/// root     m, inside
/// openings to which short branches may lead; others that are short are left out as dents of the wall
/// returns  parents before their children; branch 0 begins at the root
/// fails    BadValue: the root lies outside
[[nodiscard]] Result<std::vector<CentrelineBranch>> find_branches(const TriMesh& closed, const spheretree::LumenTree& lumen, const Vec3& root,
                                                                  std::span<const VesselEnd> openings, Centring centring = Centring::Full);

/// The way along the branches to the end of one, from the root: points and radii.
struct CentrelineWay {
    std::vector<Vec3> points;
    std::vector<double> radii;
    double length = 0.0; // m
};
[[nodiscard]] CentrelineWay way_to(std::span<const CentrelineBranch> branches, Index branch);

} // namespace trocar::engine
