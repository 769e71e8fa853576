// The bounding-volume hierarchies that set-based culling was compared with: one box or one sphere around each swept triangle, refitted
// bottom up, tested against itself, and every pair of triangles that is left tested feature by feature. For measurement only, not for
// use. source   what Govindaraju et al. (2005), section 6.2, describe of AABB and sphere trees
#pragma once

#include "collision/culling/near_triangles.hpp"
#include "collision/ccd/sweep_batch.hpp"

#include <vector>

namespace trocar::engine {

enum class VolumeKind : std::uint8_t { Box, Sphere };

class VolumeHierarchy {
public:
    /// Median splits along the longest extent of the triangles' centres. The topology must outlive it.
    VolumeHierarchy(VolumeKind kind, const collision::SurfaceTopology& surface, std::span<const Vec3> positions);

    void refit(const collision::SurfaceMotion& motion, double distance);
    /// Pairs of triangles whose volumes overlap, adjacent ones among them.
    void find_pairs(std::vector<collision::TrianglePair>& pairs);
    /// The same between two.
    void find_pairs(VolumeHierarchy& other, std::vector<collision::TrianglePair>& pairs);

private:
    struct Volume {
        Vec3 low, high; // box; of a sphere: centre, and the radius in high.x()
    };
    struct Node {
        Volume volume;
        Index left = kNoIndex; // the right child follows it; kNoIndex: a leaf
        Index triangle = kNoIndex;
    };
    void split(std::span<const Vec3> centres, std::span<Index> ids, Index node);
    [[nodiscard]] Volume around(const collision::SurfaceMotion& motion, const Triangle& t, double distance) const;
    [[nodiscard]] Volume join(const Volume& a, const Volume& b) const;
    [[nodiscard]] bool overlap(const Volume& a, const Volume& b) const;
    [[nodiscard]] double size(const Volume& v) const;

    VolumeKind kind_;
    const collision::SurfaceTopology* surface_;
    std::vector<Node> nodes_;
    std::vector<std::pair<Index, Index>> stack_;
};

/// Pairs of features of pairs of triangles: six of vertex and face, nine of edges; of adjacent ones those that share nothing. A pair of
/// features comes as often as pairs of triangles hold it.
struct PairFeatures {
    std::vector<collision::FeaturePair> vertex_face, face_vertex, edge_edge;
    [[nodiscard]] std::size_t size() const noexcept { return vertex_face.size() + face_vertex.size() + edge_edge.size(); }
};
void list_features(const collision::SurfaceTopology& a, const collision::SurfaceTopology& b, std::span<const collision::TrianglePair> pairs,
                   PairFeatures& out);

} // namespace trocar::engine
