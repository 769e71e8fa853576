// Image-space culling as in the image-space paper, for comparison: patches of a hierarchy drawn at the centres of pixels, LESS and GREATER,
// in a forward and a backward pass; a patch that neither hides any of itself or of another, nor is hidden, is pruned; the rest is replaced
// by its children. It is NOT safe: overlaps smaller than a pixel, triangles seen edge-on and contact without penetration are lost, as the
// paper says. The conservative form is collision/culling/image_space.hpp.
// This work is based on: the image-space paper, a self-collision extension of Govindaraju, Redon, Lin, Manocha, "CULLIDE" (2003), figure 3.
#pragma once

#include "collision/culling/cull_frame.hpp"
#include "collision/culling/patch_hierarchy.hpp"

#include <vector>

namespace trocar::collision {

struct CullidePlan {
    int resolution = 500;
    int idle_passes = 3; // views without anything pruned, once only single triangles are left, after which it ends
    int max_passes = 200;
};

/// One view, forward and backward.
struct CullidePass {
    std::size_t patches = 0, pruned = 0;
    std::size_t triangles = 0; // drawn in each of the four renderings of the passes
    std::size_t queries = 0;
};

class Cullide {
public:
    Cullide(std::span<const Triangle> triangles, PatchHierarchy hierarchy)
        : triangles_(triangles.begin(), triangles.end()), hierarchy_(std::move(hierarchy)) {}

    /// Ids of the triangles that were not pruned, ascending; along the axes in turn. Positions must be finite.
    [[nodiscard]] std::vector<Index> find_colliding_set(std::span<const Vec3> positions, const CullidePlan& plan);
    [[nodiscard]] std::span<const CullidePass> passes() const noexcept { return passes_; } // of the last call

private:
    struct Corner {
        double x, y, z; // pixels, depth in (0, 1)
    };
    template <class Visit>
    void for_each_sample(Index triangle, Visit&& visit) const;
    void draw(Index patch);
    [[nodiscard]] bool is_hidden(Index patch) const;
    void look(std::span<const Vec3> positions, int axis, const CullidePlan& plan);

    std::vector<Triangle> triangles_;
    PatchHierarchy hierarchy_;
    std::vector<Index> live_; // patches
    std::vector<Corner> corners_;
    std::vector<float> depth_;
    int size_ = 0;
    std::vector<CullidePass> passes_;
};

} // namespace trocar::collision
