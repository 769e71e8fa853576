// Places in the middle of a vessel, found from a point of its wall: where an instrument is to go, or to enter. At rest.
#pragma once

#include "base/result.hpp"
#include "base/triangle_tree.hpp"
#include "spheretree/lumen/centreline.hpp"

#include <optional>
#include <vector>

namespace trocar::engine::viewer {

/// A point of a vessel's wall.
struct WallPoint {
    Index triangle = kNoIndex;
    Vec3 point = Vec3::Zero(); // m
};

struct MiddlePlace {
    Vec3 position = Vec3::Zero(); // m
    double radius = 0.0;          // m, to the wall
};

struct EntryPlace {
    Vec3 position = Vec3::Zero();   // m
    Vec3 direction = Vec3::UnitZ(); // unit, into the vessel
    double radius = 0.0;            // m, to the wall
};

class LumenPlaces {
public:
    /// The centreline comes from the cache of prepared geometry, where it has been found before.
    /// lumen  must outlive it     root  m, inside: the centreline begins there
    /// fails  BadValue: the root lies outside
    [[nodiscard]] static Result<LumenPlaces> make(const spheretree::LumenTree& lumen, const Vec3& root);

    /// From the root into every branch, without dents of the wall and the corners of caps; radii are distances to the wall.
    [[nodiscard]] const spheretree::CentrelineTree& centreline() const noexcept { return centreline_; }
    /// Points that a vessel ends at: tips of branches, and the root where one way leads from it.
    [[nodiscard]] const std::vector<Index>& ends() const noexcept { return ends_; }

    /// The inscribed sphere that touches the wall at the point leads to the centreline; in a sac that no branch leads into, to the middle of
    /// the sac.
    [[nodiscard]] MiddlePlace middle_at(const WallPoint& wall) const;
    /// On the centreline, at its end where that is within two radii; the direction is that of the longer way.
    /// fails  BadValue: the centreline is a single point
    [[nodiscard]] Result<EntryPlace> entry_at(const WallPoint& wall) const;
    /// m from the place straight ahead, as far as there is `clearance` [m] around it, `most` at most.
    [[nodiscard]] double free_ahead(const EntryPlace& entry, double clearance, double most) const;

private:
    explicit LumenPlaces(const spheretree::LumenTree& lumen) : lumen_(&lumen) {}
    /// Distances along the centreline from a point, and the point that each was reached from.
    struct Ways {
        std::vector<double> length; // [point_count] m
        std::vector<Index> before;  // [point_count] kNoIndex: the first
    };

    void trim_corners();
    void drop_stubs();
    void find_neighbours();
    [[nodiscard]] double clearance_at(const Vec3& p) const noexcept;
    [[nodiscard]] Index find_touching_ball(const WallPoint& wall) const;
    [[nodiscard]] Index find_deeper_ball(Index ball) const;
    [[nodiscard]] std::optional<Index> find_point_around(const Vec3& p, const Vec3& near) const;
    [[nodiscard]] Index find_nearest_point(const Vec3& p) const;
    [[nodiscard]] Ways find_ways(Index from) const;
    [[nodiscard]] Index find_end_near(Index point) const;
    [[nodiscard]] Vec3 direction_from(Index point) const;

    const spheretree::LumenTree* lumen_;
    TriangleTree wall_;
    spheretree::CentrelineTree centreline_;
    std::vector<std::vector<Index>> neighbours_; // [point_count]
    std::vector<Index> ends_;
};

} // namespace trocar::engine::viewer
