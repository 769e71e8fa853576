// How one node of a baseline tree becomes several. The pieces are shared out by the caller, who grows the balls where that is
// needed to hold them.
#pragma once

#include "spheretree/build/ball_fit.hpp"

namespace trocar::spheretree {

struct NodeTask {
    std::span<const Vec3> points;
    std::span<const Index> ids;   // corners of the node's pieces, each once, ascending
    std::span<const Ball> medial; // inscribed spheres of the whole body
    Ball node;                    // the node's own
    Box3 cell;                    // octree: the node's cell
    unsigned branching = 8;
};

struct ChildBall {
    Ball ball;
    Box3 cell; // octree alone
};

/// Medial balls of the node, merged two by two, cheapest first, until `branching` are left.
[[nodiscard]] std::vector<ChildBall> split_by_merging(const NodeTask& task, const BodyDepth& body);
/// The node's cell cut in eight; circumscribed spheres.
[[nodiscard]] std::vector<ChildBall> split_by_octants(const NodeTask& task, const BodyDepth& body);

} // namespace trocar::spheretree
