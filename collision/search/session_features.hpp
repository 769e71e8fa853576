// Boxes of the features of clusters, filled on demand, and the pairs of features of two clusters whose boxes come
// near: what session_pairs.hpp keeps, and what is recomputed where keeping does not pay.
#pragma once

#include "collision/bvh/near_pairs.hpp"
#include "collision/search/session_shapes.hpp"
#include "collision/search/surface_pair.hpp"

#include <array>
#include <vector>

namespace trocar::collision {

/// Two features by their ids in their surfaces: a vertex of one and a face of the other, or an edge of each.
enum class PairKind : std::uint8_t {
    VertexFace, // vertex of the first surface
    FaceVertex, // vertex of the second one; within one surface there are none
    EdgeEdge,   // within one surface the smaller id comes first
};
inline constexpr std::array kPairKinds{PairKind::VertexFace, PairKind::FaceVertex, PairKind::EdgeEdge};
[[nodiscard]] inline std::vector<FeaturePair>& list_of(CandidateLists& lists, PairKind kind) noexcept {
    return kind == PairKind::VertexFace ? lists.vertex_face : kind == PairKind::FaceVertex ? lists.face_vertex : lists.edge_edge;
}

/// At one instant, or over a step.
enum class BoxTime : std::uint8_t { Start, Step };

class SessionFeatures {
public:
    /// The parts and the arrays of the view must outlive it.
    void build(std::span<const SurfacePart> parts, const ShapeView& shapes);

    /// All boxes are stale from here on.
    void start_step() noexcept;

    struct Gap {
        double distance = 0.0;    // m
        Vec3 side = Vec3::Zero(); // unit, from a to b, where the distance is > 0: all of b is beyond all of a along it by that much
    };
    /// What the clusters keep at least at the start of the step: between their boxes, never above the true distance.
    [[nodiscard]] Gap gap_at_start(ClusterPlace a, ClusterPlace b) noexcept;
    /// Pairs whose boxes come within reach, appended by kind; a's surface is not behind b's.
    void collect(ClusterPlace a, ClusterPlace b, BoxTime time, double reach, bool simd, CandidateLists& out) noexcept;

    /// Clusters whose boxes, and whose blocks, were filled in this step; one at both BoxTimes counts twice.
    [[nodiscard]] std::size_t boxes_made() const noexcept { return boxes_made_; }
    [[nodiscard]] std::size_t blocks_made() const noexcept { return blocks_made_; }
    [[nodiscard]] std::size_t memory() const noexcept;

private:
    static constexpr std::size_t kRow = 6; // lo, then minus_hi
    struct Boxes {                         // of one part, at one BoxTime
        std::vector<float> vertices;       // [vertex_count][kRow]
        std::vector<float> blocks;         // [block_count][kRow][DopTree::kLanes]
        std::vector<std::array<float, kRow>> clusters;
        std::vector<std::uint32_t> boxed, filled; // [cluster_count] step in which the cluster's box was made, and its blocks
    };
    struct PartBoxes {
        std::array<Boxes, 2> at;
    };
    const std::array<float, kRow>& box_of(ClusterPlace place, BoxTime time) noexcept;
    const Boxes& fill(ClusterPlace place, BoxTime time) noexcept;
    void fill_vertices(ClusterPlace place, BoxTime time, Boxes& boxes) const noexcept;
    template <std::size_t Corners>
    void fill_blocks(const DopTree& tree, const DopTree::BlockRange& range, Boxes& boxes) const noexcept;
    void append(const SurfacePart& a, const SurfacePart& b, PairKind kind, std::size_t count, std::vector<FeaturePair>& out) const;

    std::span<const SurfacePart> parts_;
    ShapeView shapes_;
    std::vector<PartBoxes> boxes_;
    std::vector<std::vector<Index>> local_; // [part] as SurfacePart::touched, ids of the part
    std::vector<FeaturePair> found_;
    std::uint32_t step_ = 0;
    std::size_t boxes_made_ = 0, blocks_made_ = 0;
};

} // namespace trocar::collision
