// The balls of one level moved so that less of them lies outside the body, while each goes on holding its points.
//
// The builders lessen how far a ball reaches outside, a length; what their union adds to the body is a volume, and balls that
// reach equally far add different ones. Deviates from Bradshaw & O'Sullivan 2004, who optimise the reach alone.
#pragma once

#include "spheretree/build/ball_fit.hpp"
#include "spheretree/build/piece.hpp"

namespace trocar::spheretree {

/// Points outside the body, near its surface: each stands for as much volume as the other.
class ShellPoints {
public:
    /// pieces   of the whole surface, outward      height  m, how far outside points lie at most      count  about so many
    ShellPoints(std::span<const Piece> pieces, const PieceSet& set, const BodyDepth& body, double height, std::size_t count);
    [[nodiscard]] const PointTree& tree() const noexcept { return tree_; }
    [[nodiscard]] const std::vector<Vec3>& points() const noexcept { return points_; }
    [[nodiscard]] std::size_t size() const noexcept { return points_.size(); }

private:
    std::vector<Vec3> points_;
    PointTree tree_;
};

/// Moves centres, a few rounds, all balls of a round side by side: a ball goes where it holds fewer points that hardly another
/// ball holds. No ball reaches farther outside than the farthest of the level did, and each holds the points it is to hold.
/// holds  [balls] point ids into set      balls  depths exact, in and out
void trim_balls(const ShellPoints& shell, std::span<const std::vector<Index>> holds, const PieceSet& set, const BodyDepth& body,
                std::span<Ball> balls);

} // namespace trocar::spheretree
