// Segments of one chain that come near each other, as capsules: which they are, and how much of a motion is proven to keep them apart.
#pragma once

#include "base/box.hpp"
#include "base/vec.hpp"

#include <array>
#include <span>
#include <vector>

namespace trocar::fem {

struct SegmentPair {
    Index a = 0, b = 0;            // segments a < b, of nodes (a, a + 1) and (b, b + 1)
    double s = 0.0, t = 0.0;       // [-] their nearest points: of a + 1 and of b + 1
    Vec3 normal = Vec3::UnitX();   // unit, from b's nearest point to a's
    double distance = 0.0;         // m
};

/// Which segments of a chain are pairs at all: those between which it has room to bend back. A tube of radius r that turns as sharply as it
/// can comes back beside itself after pi r of its axis; what is nearer along the axis is kept apart by bending alone (Gonzalez & Maddocks
/// 1999 call the rest the chain's global curvature).
struct ChainRule {
    double radius = 0.0; // m
    double segment = 0.0; // m, rest length
    /// Segments from a to b, at least.
    [[nodiscard]] Index least_gap() const noexcept;
};

/// Boxes over runs of a chain's segments, halved again and again: the tree whose pairs are tested.
class ChainBoxes {
public:
    void reserve(std::size_t nodes) { runs_.reserve(nodes); }
    /// Lists the pairs whose nearest points are closer than `within` and the reaches of both, by (a, b).
    /// axis   [node_count] m
    /// reach  [node_count] m; a segment's is that of its farther node
    /// cost   O(n) for a chain that keeps away from itself, and so much for each pair beyond that
    void find_pairs(std::span<const Vec3> axis, const ChainRule& rule, double within, std::span<const double> reach,
                    std::vector<SegmentPair>& pairs);

    /// The boxes of a chain from segment `begin` on, for find_pairs_with. Both lists outlive that.
    void bound(std::span<const Vec3> axis, std::span<const double> reach, Index begin);
    /// Lists the same of segments a of this chain and b of another one, by (a, b): appended to `pairs`.
    void find_pairs_with(const ChainBoxes& other, double within, std::vector<SegmentPair>& pairs) const;

private:
    struct Run {
        Index begin, end; // segments
        Index left, right; // runs; 0: a leaf
        Box3 box; // of the nodes, grown by their reach
    };
    Index build(Index begin, Index end);
    void meet_itself(Index run);
    void meet(Index a, Index b);
    void test(Index a, Index b);
    void meet_other(Index run, const ChainBoxes& other, Index its, double within, std::vector<SegmentPair>& pairs) const;

    std::vector<Run> runs_;
    std::span<const Vec3> axis_;
    std::vector<SegmentPair>* pairs_ = nullptr;
    std::span<const double> reach_;
    Index least_gap_ = 2;
    double within_ = 0.0; // m
};

/// The nearest points of two segments. Where they cross, the normal is across both.
[[nodiscard]] SegmentPair nearest_on_pair(Index a, Index b, const std::array<Vec3, 4>& corners) noexcept;

/// Up to which share of a straight motion of all four corners are two segments proven to be at least `limit` apart? Each plane across the
/// way between their nearest points separates them for as long as its corners stay on their sides; where it ends the next one begins
/// (Mirtich & Canny's conservative advancement, by separating planes).
/// from, to   m, a's corners, then b's
/// Returns 1 for all of it, and 0 where they are nearer than that at the start.
[[nodiscard]] double share_apart(const std::array<Vec3, 4>& from, const std::array<Vec3, 4>& to, double limit) noexcept;

} // namespace trocar::fem
