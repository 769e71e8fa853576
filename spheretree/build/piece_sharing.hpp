// Shares the pieces of a surface out among balls, so that every piece lies whole in the ball that it is given to.
#pragma once

#include "spheretree/build/ball_fit.hpp"
#include "spheretree/build/piece.hpp"

namespace trocar::spheretree {

/// Ids of all corners, each once, ascending.
[[nodiscard]] std::vector<Index> corners_of(std::span<const Piece> pieces);

/// How many pieces cuts may lead to. Ordinary bodies come to about 200 a leaf; a surface drawn out into needles can be arbitrarily long
/// with next to no area, and would be cut without end.
struct CutLimit {
    std::size_t most = 0;
    bool reached = false; // pieces are larger than they should be, and spheres with them
};

/// Cuts pieces until no edge is longer than `longest` [m]; where that leads to too many,
/// until none is longer than twice that, four times that, and so on.
void cut_to(double longest, PieceSet& set, std::vector<Piece>& pieces, CutLimit& limit);

/// Balls that must hold whatever a ball of the last level holds.
struct Lineage {
    std::vector<std::vector<Ball>> levels;   // the level right above first; empty: nothing above but a root that holds all
    std::vector<std::vector<Index>> parents; // [levels] of each ball of the level below it
};

/// Each piece goes to the ball that holds it with least overhang needed. A piece that no ball holds is cut; once its parts are
/// small against the ball, the ball that has to grow least grows, its ancestors with it. Radii only ever grow here.
/// smallest  [-] of a ball's radius: pieces no larger are not cut, the ball grows instead: finer means tighter, and more pieces
/// limit     where it is reached, all is shared out anew with larger smallest pieces: balls then grow where pieces would be cut
/// returns   [balls] pieces of each
[[nodiscard]] std::vector<std::vector<Piece>> share_pieces(std::span<const Piece> pieces, std::span<Ball> balls, PieceSet& set,
                                                           Lineage& above, double smallest, CutLimit& limit);

} // namespace trocar::spheretree
