// Image-space potentially colliding sets: which triangles of a static soup may cross another one, self-intersections
// included? Views from several sides prune what is free of everything else; exact tests are left for the rest.
// This work is based on: the image-space paper, a self-collision extension of Govindaraju, Redon, Lin, Manocha, "CULLIDE" (2003). Deviates:
// the paper asks whether an object hides any part of itself, at the centres of pixels, and so misses overlaps below a pixel, triangles seen
// edge-on, and contact without penetration. Here triangles are covered conservatively and queried by chromatic sets: those that share
// a vertex always overlap then, and are exempt by their ids. Nothing that crosses is lost, at any resolution. As in the paper whole
// patches of a hierarchy on the mesh's connectivity go first (collision/culling/patch_culler.hpp).
#pragma once

#include "collision/culling/chromatic_sets.hpp"
#include "collision/culling/patch_culler.hpp"
#include "collision/culling/set_culler.hpp"

#include <functional>
#include <optional>
#include <vector>

namespace trocar::collision {

/// One view.
struct ImageSpacePass {
    Vec3 direction;
    std::size_t triangles = 0, triangles_left = 0; // drawn; not yet free of everything
    std::size_t questions = 0;                     // (triangle or patch, set) queried
    int resolution = 0;                            // pixels a side
    unsigned lowered_for_memory = 0;               // as CullReport
    // where whole patches were queried; otherwise 0
    std::size_t largest_patch = 0; // triangles, of this level
    std::size_t patches = 0;       // drawn
    std::size_t asking = 0;        // of them, those that do not cross themselves and what they touch: the others cannot be pruned
};

struct ImageSpacePlan {
    CullMemory memory = CullMemory::Intervals;
    int resolution = 0;       // pixels a side; 0: what the backend prefers
    bool patches = true;      // whole patches first
    int max_passes = 9;       // views of single triangles
    double worthwhile = 0.03; // the CPU takes over after a pass that pruned less than this share of what was left
    /// In its place, for callers with a clock: shall there be another pass after this one? Called from the third one of triangles on.
    std::function<bool(const ImageSpacePass&)> go_on = {};
    std::function<void(const ImageSpacePass&)> watch = {}; // called after every pass
    bool coherent_views = true;                            // directions that pruned most in the last call come first in this one
};

class ImageSpaceCuller {
public:
    ImageSpaceCuller(std::span<const Triangle> triangles, std::size_t vertex_count);

    /// Before the first call that asks whole patches; otherwise that one does it. cost   O(n log n)
    void prepare_patches();

    /// Ids of the triangles that may cross one that shares no vertex with them, ascending. Those with a coordinate that is not finite
    /// are left out: nothing crosses them.
    /// fails   as the backend does
    [[nodiscard]] Result<std::vector<Index>> find_colliding_set(std::span<const Vec3> positions, const ImageSpacePlan& plan,
                                                                CullBackend& backend);

    [[nodiscard]] std::span<const ImageSpacePass> passes() const noexcept { return passes_; } // of the last call, patches first
    [[nodiscard]] const ChromaticSets& sets() const noexcept { return sets_; }

private:
    [[nodiscard]] Vec3 direction_of(int pass, std::span<const Vec3> positions, const ImageSpacePlan& plan) const noexcept;
    void keep_view_order();
    [[nodiscard]] Result<void> cull_patches(std::span<const Vec3> positions, const ImageSpacePlan& plan, CullBackend& backend);
    [[nodiscard]] Result<void> look(std::span<const Vec3> positions, const Vec3& direction, const ImageSpacePlan& plan,
                                    CullBackend& backend);

    std::vector<Triangle> triangles_;
    std::size_t vertex_count_;
    ChromaticSets sets_;
    std::optional<PatchCuller> patches_;     // made on first use
    std::vector<std::vector<Index>> asking_; // [set] triangles not yet free of it, ascending
    CullView view_;
    std::vector<Index> live_; // triangles with a question left, ascending
    std::vector<ImageSpacePass> passes_;
    std::vector<Vec3> best_views_; // of the last call, most pruned first
};

/// Pairs of the given triangles that properly cross and share no vertex: lower id first, sorted. Exact.
[[nodiscard]] std::vector<TrianglePair> find_crossings(std::span<const Triangle> triangles, std::span<const Vec3> positions,
                                                       std::span<const Index> ids);

} // namespace trocar::collision
