// At most B balls that together hold given points and reach as little as possible outside the body: one node of a wrapped
// sphere tree.
//
// This work is based on: Bradshaw & O'Sullivan 2004 (candidates from the medial axis, expand and select); Stolpner, Kry,
// Siddiqi 2012, "Medial spheres for shape approximation" (few medial balls as a covering problem); Wang et al. 2006,
// "Variational sphere set approximation" (alternate between sharing out the points and fitting the balls).
// Deviates: the largest overhang is what is minimised first, by bisection over greedy covers; then the sum of overhangs.
#pragma once

#include "spheretree/build/ball_fit.hpp"

namespace trocar::spheretree {

struct CoverTask {
    std::span<const Vec3> points;
    std::span<const Index> ids;       // of the points to hold
    std::span<const Ball> candidates; // centres and depths; radii are not used
    unsigned most = 8;                // balls at most
    bool brief = false;               // a first guess will do
    std::size_t samples = 768;        // points that the greedy cover examines: it begins with half as many as it ends with
};

/// Every ball holds the points that are best left to it; together all of them. Never empty for points that are not.
/// owner    [ids] the ball of each point
[[nodiscard]] std::vector<Ball> cover_points(const CoverTask& task, const BodyDepth& body, std::vector<std::uint16_t>& owner);

/// Alternates between giving each point to the ball that needs to grow least for it and fitting the balls anew.
void improve_cover(const CoverTask& task, const BodyDepth& body, unsigned rounds, std::vector<Ball>& balls,
                   std::vector<std::uint16_t>& owner);

} // namespace trocar::spheretree
