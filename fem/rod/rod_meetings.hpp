// Rods that meet one another: half-spaces that a place of one rod carries and a place of another one keeps to (RodMeeting), and the proof
// that no two of them passed through each other on the way. self_contact.hpp is the same of a rod and itself, whose words this file uses.
// docs/contact.md, "Two rods".
#pragma once

#include "fem/rod/chain_pairs.hpp"
#include "fem/rod/moved_rod.hpp"
#include "fem/rod/rods_together.hpp"

#include <array>
#include <vector>

namespace trocar::fem {

/// Room for so many meetings of each node. More of them make a step allocate.
inline constexpr std::size_t kMeetingsPerNode = 8;

class RodMeetings {
public:
    /// nodes   of all rods together
    void reserve(std::size_t nodes);

    /// What a step starts with: each node's reach, and the pairs of segments within them.
    void begin(std::span<const MovedRod> rods, double step);
    /// The half-spaces of all pairs, and of those that would meet on the way where they would; those of the last step hand on their forces.
    void list_planes(std::span<const MovedRod> rods, std::vector<RodMeeting>& meetings);
    /// Did a solve that ended at `to` keep apart all the way what it may not pass, and in its bore what has play there? Where not `meetings` is
    /// changed: it wants to be solved again.
    /// settled   the solve's forces mean something: limits of bores begin the next one with them
    [[nodiscard]] bool check(std::span<const MovedRod> rods, bool settled, std::vector<RodMeeting>& meetings);
    /// Returns the share of the motion of all of them, whatever moved them since, that is proven.
    [[nodiscard]] double find_proven_share(std::span<const MovedRod> rods);

    /// Has rod k of the list a pair with another one?
    [[nodiscard]] bool may_meet(std::size_t k) const noexcept;

private:
    struct Pair {
        SegmentPair at;
        Index one = 0, other = 0; // rods of the list
    };
    void find_pairs(std::span<const MovedRod> rods);
    void find_pairs_of(std::span<const MovedRod> rods, Index one, Index other);
    [[nodiscard]] bool lengthen_reaches(std::span<const MovedRod> rods);
    [[nodiscard]] static bool leaves_bore(std::span<const MovedRod> rods, std::span<const RodMeeting> meetings) noexcept;
    [[nodiscard]] const Pair* find_pair(const Pair& like, Index a, Index b) const noexcept;
    [[nodiscard]] bool is_pushed_elsewhere(const Pair& pair) const noexcept;
    [[nodiscard]] RodMeeting plane_of(std::span<const MovedRod> rods, const Pair& pair) const noexcept;
    void hand_on(RodMeeting& meeting);
    double prove(std::span<const MovedRod> rods, const Pair& pair, std::vector<RodMeeting>* meetings) const;

    std::array<ChainBoxes, kMostTogether> boxes_;
    std::array<std::vector<double>, kMostTogether> reach_; // [node_count] m
    std::vector<SegmentPair> found_;
    std::vector<Pair> pairs_; // by rods, then segments
    std::vector<RodMeeting> last_; // of the last step
    std::vector<std::uint8_t> taken_; // [last_] a newer one goes on with its forces
    std::array<Index, kMostTogether> first_{}; // node of rod k of the list that has passed its port, and the mouth of the bore that it is in
    std::array<bool, kMostTogether> in_bore_{}; // rod k of the list is in a bore, or has a rod in its own
    double step_ = 0.0; // s
    bool listed_again_ = false; // in this step, since a solve left a bore
};

} // namespace trocar::fem
