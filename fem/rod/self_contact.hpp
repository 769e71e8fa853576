// A rod that meets itself: planes that one place of it carries and another one keeps to (RodPlane::other), and the proof that no two parts
// of it passed through each other on the way. docs/contact.md, "A rod and itself".
//
// Pairs of segments are those that the step's motion could bring within two radii of one another, by a reach of every node: pairs beyond
// the reaches of both stay apart while no node goes farther than its own. A plane lies across the nearest points of a pair where their
// distance has a local minimum. After a solve the straight motion of every pair is proven (share_apart): what is not gets one more plane
// where it would have met, a node that left its reach a longer one, and the rod is solved again.
#pragma once

#include "fem/rod/chain_pairs.hpp"
#include "fem/rod/rod_model.hpp"

namespace trocar::fem {

/// [-] of the diameter: what is kept beyond it, and by how much less is called apart all the same.
inline constexpr double kSelfClearance = 5e-3, kSelfSlack = 2.5e-3;

/// Room for so many planes and pairs of each node: a tightly packed coil has some 6. More of them make a step allocate.
inline constexpr std::size_t kSelfPlanesPerNode = 16;

class SelfContact {
public:
    void reserve(std::size_t nodes);
    /// What a step starts with. No lists longer than before: nothing is allocated once each has had its longest size.
    /// from   [node_count] m, where the step started
    /// guess  [node_count] m, where it may end
    /// What is behind the port lies in the device that the rod comes out of, and is in the way as well.
    void begin(const RodModel& model, std::span<const Vec3> from, std::span<const Vec3> guess, double step);
    [[nodiscard]] bool has_begun() const noexcept { return begun_; }
    void end() noexcept { begun_ = false; }

    /// The planes of all pairs, and of those that would meet on the way to `guess` where they would; those of the last step hand on their
    /// forces.
    void list_planes(const RodModel& model, std::span<const Vec3> from, std::span<const Vec3> guess, std::vector<RodPlane>& planes);

    /// Does a solve that ended at `to` keep what it may not pass apart all the way? Where not `planes` is changed: it wants to be solved again.
    /// The share of the motion that is proven is then less than 1.
    [[nodiscard]] bool check(const RodModel& model, std::span<const Vec3> from, std::span<const Vec3> to, std::vector<RodPlane>& planes);

    [[nodiscard]] double proven_share() const noexcept { return proven_share_; }

private:
    [[nodiscard]] bool is_pushed_elsewhere(std::size_t pair) const noexcept;
    [[nodiscard]] const SegmentPair* find_pair(Index a, Index b) const noexcept;
    void hand_on(RodPlane& plane);
    double add_met(const RodModel& model, const SegmentPair& pair, std::span<const Vec3> from, std::span<const Vec3> to,
                   std::vector<RodPlane>& planes) const;

    ChainBoxes boxes_;
    std::vector<SegmentPair> pairs_;
    std::vector<double> reach_;         // [node_count] m
    std::vector<RodPlane> last_;        // of the last step, by place
    std::vector<std::uint8_t> taken_;   // [last_] a newer plane goes on with its forces
    double step_ = 0.0;                 // s
    double proven_share_ = 1.0;
    bool begun_ = false;
};

} // namespace trocar::fem
