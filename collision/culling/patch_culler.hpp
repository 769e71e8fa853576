// Whole patches of a static surface pruned in image space, with no crossing lost: the hierarchy of the image-space paper (an
// extension of CULLIDE, 2003), section 3.1, made conservative. A patch crosses nothing if
// 1. it and the patches that it touches cross neither themselves nor one another: seen along some direction all their faces are turned
//    the same way and their outline is simple (collision/bvh/contour.hpp). The paper asks whether a patch hides nothing of itself, at the
//    centres of pixels, and so misses what is smaller; this is proven on the surface itself;
// 2. it is free of all other patches, in image space: of every set of them in some view. Hulls are drawn and queried, conservatively
//    (collision/culling/cull_frame.hpp), and those that touch it are exempt by their ids.
// What is not pruned falls into smaller patches. The neighbourhood of a smaller patch is part of its parent's, so 1 is inherited.
#pragma once

#include "collision/culling/chromatic_sets.hpp"
#include "collision/bvh/contour.hpp"
#include "collision/culling/cull_view.hpp"
#include "collision/culling/patch_hierarchy.hpp"

namespace trocar::collision {

class PatchCuller {
public:
    PatchCuller() = default;
    PatchCuller(std::span<const Triangle> triangles, std::size_t vertex_count);

    /// Before the first level: nothing is proven.
    /// live    ascending; their corners are finite
    void start(std::span<const Vec3> positions, std::span<const Index> live);
    /// Patches of at most so many triangles, of those that are live: which touch, which of them condition 1 is proven for, and sets.
    void start_level(std::span<const Index> live, std::size_t largest);
    /// One view of the level. Patches free of everything are pruned.
    /// fails   as the backend does
    [[nodiscard]] Result<CullView::Outcome> look(const ViewDirection& direction, const CullView::Settings& settings, CullBackend& backend);
    /// Takes the triangles of pruned patches out; the order stays.
    void drop_pruned(std::vector<Index>& live) const;

    [[nodiscard]] std::size_t patches_left() const noexcept { return patches_left_; }
    [[nodiscard]] std::size_t patches_asking() const noexcept { return asking_left_; }      // condition 1 holds, 2 is not yet known to
    [[nodiscard]] std::size_t questions() const noexcept { return view_.questions.size(); } // of the last view
    [[nodiscard]] std::size_t pruned() const noexcept { return pruned_; }                   // triangles, of the last view
    [[nodiscard]] Index set_count() const noexcept { return static_cast<Index>(asking_.size()); }

private:
    struct Patch {
        Index begin, end; // into members_
        Index set = 0;
        std::uint32_t sets_left = 0; // not yet known to be free of
        bool asks = false, pruned = false;
        bool at_hub = false; // touches more patches at one vertex than are listed
    };
    [[nodiscard]] std::span<const Index> members(Index patch) const noexcept {
        return std::span(members_).subspan(patches_[patch].begin, patches_[patch].end - patches_[patch].begin);
    }
    [[nodiscard]] std::span<const Index> touching(Index patch) const noexcept {
        return std::span(near_).subspan(near_begin_[patch], near_begin_[patch + 1] - near_begin_[patch]);
    }
    [[nodiscard]] std::span<const Index> corners(Index patch) const noexcept {
        return std::span(vertices_).subspan(vertex_begin_[patch], vertex_begin_[patch + 1] - vertex_begin_[patch]);
    }
    void cut(std::span<const Index> live, std::size_t largest);
    void find_touching();
    void make_sets();
    void find_across();
    [[nodiscard]] bool find_border();
    [[nodiscard]] bool is_turned_one_way(const Vec3& direction) const;
    [[nodiscard]] bool is_proven(Index patch);
    void gather_view();
    [[nodiscard]] Index place_of_asker(Index patch, Index set);

    std::vector<Triangle> triangles_;
    PatchHierarchy hierarchy_;
    /// [triangle_count] across each edge, from corner k to the next: kNoIndex: none; kSeveral: more than one face, or one that runs
    /// through it the same way
    std::vector<std::array<Index, 3>> across_;
    // of the current positions
    std::span<const Vec3> positions_;
    std::vector<Vec3> normals_;           // [triangle_count] of any length
    std::vector<std::uint8_t> is_proven_; // [triangle_count] condition 1 holds for a patch that holds it
    std::vector<std::uint8_t> is_live_;   // [triangle_count]
    // of the current level
    std::vector<Patch> patches_;
    std::vector<Index> members_;                 // triangles, patch by patch
    std::vector<Index> vertices_, vertex_begin_; // of the patches, each once
    std::vector<Index> near_, near_begin_;       // patches that share a vertex, ascending
    std::vector<std::vector<Index>> asking_;     // [set_count] patches not yet known to be free of it
    std::size_t patches_left_ = 0, asking_left_ = 0, pruned_ = 0;
    // scratch
    CullView view_;
    std::vector<Index> place_, region_, stamp_;
    std::vector<std::array<Index, 2>> border_;
    std::vector<std::uint32_t> in_region_; // [triangle_count] the last region that held it
    std::uint32_t region_now_ = 0;
    std::vector<std::uint8_t> taken_;
    Index stamp_now_ = 0;
    Contour contour_;
    ContourTest outline_;
};

} // namespace trocar::collision
