// Which part of the wall moves a ball, and how.
#pragma once

#include "base/triangle_tree.hpp"
#include "spheretree/lumen/lumen_tree.hpp"

namespace trocar::spheretree {

/// Fills wall_begin, wall_triangles, anchor_begin, anchors and anchor_weights of a tree whose balls and wall are set.
/// link_reach  [-] of the ball's radius
void add_wall_links(LumenTree& lumen, const TriangleTree& wall, double link_reach);

/// Fills neighbour_begin and neighbours.
void add_neighbours(LumenTree& lumen);

} // namespace trocar::spheretree
