// All pairs of faces of moving surfaces that are nearer to each other than d_close, or come so near during a step, with their closest
// points: the system of "Hierarchical techniques in collision detection for cloth animation" (Mezger, Kimmerle, Etzmuss 2003), each of
// its techniques a switch (proximity_policies.hpp). With exact switches alone the answer is that of testing every face against every
// other one, to the bit, whatever the tree.
#pragma once

#include "collision/proximity/proximity_traversal.hpp"

#include <span>
#include <vector>

namespace trocar::collision {

class ProximitySearch {
public:
    /// surfaces   their topologies must outlive the search and stay as they are; body ids are their places in this list, at most 65,536
    /// positions  [surface][vertex] shape of the trees
    /// fails      on an option that is not possible, a position that is not finite or beyond 1e30 m, an index beyond the vertices
    [[nodiscard]] Result<void> build(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
                                     const ProximityOptions& options);

    /// Bounds and cones of a new step. Motions must live until find() has ended.
    /// fails   where a surface's connectivity is not what build() was given, a count is not, or a coordinate is not finite or beyond
    ///         1e30 m: body, vertex and value named. The search is then as it was before the call, and waits for another refit().
    [[nodiscard]] Result<void> refit(std::span<const SurfaceMotion> motions);

    /// proximities   replaced: sorted by bodies and faces
    /// Must follow a refit() that succeeded (assert). No allocation once the lists have their capacity.
    void find(std::vector<Proximity>& proximities);

    [[nodiscard]] const ProximityOptions& options() const noexcept { return options_; }
    [[nodiscard]] const ProximityStats& stats() const noexcept { return stats_; }                   // of the last find
    [[nodiscard]] const ConeTree::RefitStats& refit_stats() const noexcept { return refit_stats_; } // of the last refit
    [[nodiscard]] std::span<const ConeTree> trees() const noexcept { return trees_; }
    [[nodiscard]] std::size_t memory() const noexcept; // bytes of trees and lists

private:
    struct Job {
        SurfaceIndex a, b;
        ProximityTraversal traversal;
    };
    [[nodiscard]] Result<void> check_motion(SurfaceIndex surface, const SurfaceMotion& motion) const;

    ProximityOptions options_;
    std::vector<ConeTree> trees_;
    std::vector<std::uint64_t> fingerprints_; // [surface] of its connectivity
    std::vector<ProximitySide> sides_;        // [surface]
    std::vector<double> largest_;             // [surface] m, largest coordinate of the step
    std::vector<std::vector<Vec3>> expected_; // [surface][vertex] m, t1 of the last step, where velocity cones' reuse is on
    std::vector<Job> jobs_;
    bool ready_ = false, found_ = true, has_expected_ = false;
    ProximityStats stats_;
    ConeTree::RefitStats refit_stats_;
};

/// Every face against every other one: what the search is compared with. Only distances, during_step, between, within and the leaf test
/// of the options count.
/// cost   O(n^2)
void find_all_proximities(std::span<const SurfaceMotion> motions, const ProximityOptions& options, std::vector<Proximity>& out);

} // namespace trocar::collision
