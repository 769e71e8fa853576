// Shares the pieces of a surface out among balls, so that every piece lies whole in the ball that it is given to.
#pragma once

#include "spheretree/ball_fit.hpp"
#include "spheretree/piece.hpp"

namespace seldinger::spheretree {

/// Ids of all corners, each once, ascending.
[[nodiscard]] std::vector<Index> corners_of(std::span<const Piece> pieces);

/// Cuts pieces until no edge is longer than `longest` [m].
void cut_to(double longest, PieceSet& set, std::vector<Piece>& pieces);

/// Balls that must hold whatever a ball of the last level holds.
struct Lineage {
    std::vector<std::vector<Ball>> levels;   // the level right above first; empty: nothing above but a root that holds all
    std::vector<std::vector<Index>> parents; // [levels] of each ball of the level below it
};

/// Each piece goes to the ball that holds it with least overhang needed. A piece that no ball holds is cut; once its parts are
/// small against the ball, the ball that has to grow least grows, its ancestors with it. Radii only ever grow here.
/// smallest  [-] of a ball's radius: pieces no larger are not cut, the ball grows instead: finer means tighter, and more pieces
/// returns   [balls] pieces of each
[[nodiscard]] std::vector<std::vector<Piece>> share_pieces(std::span<const Piece> pieces, std::span<Ball> balls, PieceSet& set,
                                                           Lineage& above, double smallest);

} // namespace seldinger::spheretree
