// Clusters on either side of a plane. Layers that lie on each other and slide come no closer across the plane between them, however far
// they drift along it: drifts and boxes cannot separate them then, the layers' own normals can.
// This work is based on: Gottschalk, Lin, Manocha, "OBBTree" (1996), separating axes. Deviates: of swept hulls, along the mean normals of
// both alone; face_planes.hpp, which tests every face, is tighter and takes ten times as long.
#pragma once

#include "collision/search/session_shapes.hpp"

#include <cstdint>
#include <vector>

namespace trocar::collision {

class SessionSides {
public:
    /// The parts and the arrays of the view must outlive it. Allocates, as nothing after it does.
    void build(std::span<const SurfacePart> parts, const ShapeView& shapes);

    /// All clusters are stale from here on. motions   [surface], living until the next call
    void start_step(std::span<const SurfaceMotion> motions) noexcept;

    /// Do they share a vertex? Then no plane is between them.
    [[nodiscard]] bool are_neighbours(ClusterPlace a, ClusterPlace b) const noexcept;

    /// Pairs of clusters that do, each cluster with itself included.
    [[nodiscard]] std::size_t neighbour_pairs() const noexcept { return neighbour_pairs_; }

    struct Apart {
        bool during_step = false; // farther from each other than the distance, proven
        double at_start = 0.0;    // m, they are apart by at least that much more than the distance at t0; <= 0: nothing is proven
        Vec3 side = Vec3::Zero(); // unit, from a to b, along which they are; where something is proven
    };
    /// Along the mean normal of either, all of one must be beyond all of the other; at t0 and at t1 for the whole step, since differences
    /// of vertices move linearly. 2^-38 of the largest coordinate is taken off: for the rounding of a dozen operations, each 2^-53, and
    /// for the distance by which the elementary tests may underestimate (sweep.hpp). Non-finite or enormous coordinates prove nothing.
    /// distance   m, >= 0
    [[nodiscard]] Apart apart(ClusterPlace a, ClusterPlace b, double distance) noexcept;

    /// Clusters that were tested in this step.
    [[nodiscard]] std::size_t hulls_made() const noexcept { return hulls_made_; }
    [[nodiscard]] std::size_t memory() const noexcept;

private:
    struct Range {
        double lo, hi;
    };
    struct Hull {
        Vec3 normal = Vec3::Zero();              // of any length
        Range t0{}, t1{};                        // of the cluster along it
        double size = 0.0;                       // m, largest absolute coordinate; NaN or infinite if one is
        std::uint32_t step = 0, normal_step = 0; // that it was made in, and its normal
    };
    struct Kernel;
    struct PartHulls {
        std::vector<Hull> hulls;              // [cluster_count]
        std::vector<Index> faces, first_face; // vertices of the surface, three a face; [cluster_count + 1] into it
        std::vector<Index> neighbours, first_neighbour;
    };
    const Hull& make_hull(ClusterPlace place) noexcept;

    ShapeView shapes_;
    std::span<const SurfacePart> parts_;
    std::span<const SurfaceMotion> motions_;
    std::vector<PartHulls> parts_hulls_;
    std::size_t neighbour_pairs_ = 0, hulls_made_ = 0;
    std::uint32_t step_ = 0;
};

} // namespace trocar::collision
