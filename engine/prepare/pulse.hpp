// Displacement of each vertex of a vessel's wall by the arterial pulse.
#pragma once

#include "base/mesh.hpp"
#include "spheretree/lumen/lumen_tree.hpp"

#include <vector>

namespace trocar::engine {

/// Displacement of every wall vertex from diastole (rest) to systole: outward, a share of the local radius. The radius is that
/// of the largest inscribed sphere that touches the wall there, smoothed along the wall so that it does not jump at forks.
/// wall      closed, outward where the lumen's outside is
/// returns   [vertex_count] m
[[nodiscard]] std::vector<Vec3> find_pulse_reach(const TriMesh& wall, const spheretree::LumenTree& lumen, double amplitude);

} // namespace trocar::engine
