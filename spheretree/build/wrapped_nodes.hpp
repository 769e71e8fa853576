// Nodes of a wrapped tree while it is built, and the two ways to build: node by node from the root (baselines), or level by
// level, each as a whole.
#pragma once

#include "spheretree/build/piece_sharing.hpp"
#include "spheretree/build/wrapped_options.hpp"

#include <algorithm>
#include <functional>

namespace trocar::spheretree {

struct WrappedNode {
    Ball ball;
    Box3 cell;                         // octree alone
    std::vector<Piece> pieces;         // of leaves in the end
    std::vector<std::size_t> children; // contiguous, into the same array
    std::uint8_t level = 0;
};

/// Level by level, the root first.
struct WrappedNodes {
    std::vector<WrappedNode> nodes;
    PieceSet set{{}};
    bool coarser = false; // as WrappedTree::coarser
};

/// Pieces that a tree of so many leaves may be cut into before they are shared out, and how many more there may be after.
[[nodiscard]] constexpr std::size_t most_pieces(std::size_t leaves, std::size_t triangles) noexcept {
    return std::max<std::size_t>(400 * leaves, 200'000) + 2 * triangles;
}
inline constexpr std::size_t kMoreOfShares = 3;

/// Medial balls of a body: centres and depths.
[[nodiscard]] std::vector<Ball> find_candidates(const TriMesh& surface, const BodyDepth& body, std::size_t samples);

/// Octree and Hubbard.
/// progress  0..1 of the work, from time to time, never falling
using BuildProgress = std::function<void(double share)>;
[[nodiscard]] WrappedNodes build_by_nodes(const TriMesh& surface, const WrappedOptions& options, const BodyDepth& body, const BuildProgress& progress);
/// Medial axis and shell.
[[nodiscard]] WrappedNodes build_by_covers(const TriMesh& surface, const WrappedOptions& options, BodyDepth& body, const BuildProgress& progress);

} // namespace trocar::spheretree
