// Where the vertices of every cluster are at both ends of the step, side by side: gathered once a step, read by all tests on clusters.
#pragma once

#include "collision/lanes.hpp"
#include "collision/search/session_parts.hpp"

#include <cstring>
#include <vector>

namespace trocar::collision {

/// Four vertices, rows of kLanes: x, y, z at t0, then at t1. A short group repeats its last vertex.
inline constexpr std::size_t kShapeGroup = 6 * kLanes;

TROCAR_LANES_INLINE Lanes load_lanes(const double* from) noexcept { // of any alignment
    Lanes lanes;
    std::memcpy(&lanes, from, sizeof lanes);
    return lanes;
}

/// Spans of arrays owned elsewhere, whose addresses stay.
class ShapeView {
public:
    ShapeView() = default;
    ShapeView(std::span<const double> groups, std::span<const Index> first_group, std::span<const Index> first_cluster) noexcept
        : groups_(groups), first_group_(first_group), first_cluster_(first_cluster) {}

    /// [group][kShapeGroup]
    [[nodiscard]] std::span<const double> of(ClusterPlace place) const noexcept {
        const Index cluster = first_cluster_[place.part] + place.cluster;
        return groups_.subspan(first_group_[cluster] * kShapeGroup, (first_group_[cluster + 1] - first_group_[cluster]) * kShapeGroup);
    }

private:
    std::span<const double> groups_;
    std::span<const Index> first_group_, first_cluster_;
};

class SessionShapes {
public:
    /// The parts must outlive it. Allocates, as nothing after it does.
    void build(std::span<const SurfacePart> parts);
    /// All clusters. from, to   [surface] positions
    void gather(std::span<const std::span<const Vec3>> from, std::span<const std::span<const Vec3>> to) noexcept;

    [[nodiscard]] ShapeView view() const noexcept { return {groups_, first_group_, first_cluster_}; }
    [[nodiscard]] std::size_t memory() const noexcept;

private:
    std::span<const SurfacePart> parts_;
    std::vector<double> groups_;
    std::vector<Index> first_group_;   // [cluster_count + 1] of all parts
    std::vector<Index> first_cluster_; // [part_count]
};

/// groups   as many as the vertices fill
void gather_shape(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const Index> vertices, std::span<double> groups) noexcept;

} // namespace trocar::collision
