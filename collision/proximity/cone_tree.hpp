// The k-DOP hierarchy with one triangle per leaf whose nodes bound the motion of their vertices and the normals of their faces: the tree of
// "Hierarchical techniques in collision detection for cloth animation" (Mezger, Kimmerle, Etzmuss 2003), sections 3 to 5.
// It shares its directions, its rounding, its cuts and the overlap test of a box against all children of a node with DopTree, whose
// leaves are clusters with blocks of features for the exact search; here a leaf has its own cones, so it is one face.
// Deviates from section 4.2: where a cut leaves one side empty (the paper gives every face a node of its own if all are cut), the
// faces are halved by count, so that a node never has more than `arity` children.
//
// Every child of a node is a slot: node * arity + place. Bounds stand in rows over a node's slots, as near_children wants them.
#pragma once

#include "collision/proximity/cones.hpp"
#include "collision/bvh/contour.hpp"
#include "collision/bvh/dop.hpp"
#include "collision/proximity/face_groups.hpp"
#include "collision/proximity/proximity_policies.hpp"

#include <span>
#include <vector>

namespace trocar::collision {

struct CutPlan;

class ConeTree {
public:
    static constexpr Index kLeafBit = 0x80000000u;
    static constexpr Index kRoot = 0; // slot that holds the whole surface

    struct RefitStats {
        std::uint64_t vertices = 0, slots = 0; // whose bounds were made anew
        std::uint64_t velocity_cones = 0, normal_cones = 0;
    };

    /// The topology must outlive the tree. Positions give its shape; refit before any search.
    /// self   the surface will be tested against itself: normals, groups and outlines are kept as options.normal_cones needs them
    /// cost   O(n log n), allocates, as nothing after it does
    void build(const SurfaceTopology& topology, std::span<const Vec3> positions, const ProximityOptions& options, bool self);

    /// Bounds and cones of a new step, bottom-up. Coordinates must be finite and at most 1e30 (a broken contract otherwise).
    /// cost   O(n), no allocation
    void refit(const SurfaceMotion& motion);

    [[nodiscard]] bool empty() const noexcept { return faces_.empty(); }
    [[nodiscard]] const SurfaceTopology& topology() const noexcept { return *topology_; }
    [[nodiscard]] std::size_t arity() const noexcept { return arity_; }
    [[nodiscard]] std::size_t slabs() const noexcept { return slabs_; }
    [[nodiscard]] bool tests_itself() const noexcept { return self_; }

    [[nodiscard]] static bool is_leaf(Index child) noexcept { return (child & kLeafBit) != 0 && child != kNoIndex; }
    /// Node, or face with kLeafBit, or kNoIndex in an empty slot.
    [[nodiscard]] Index child(Index slot) const noexcept { return children_[slot]; }
    /// Slots of a node begin here.
    [[nodiscard]] Index first_slot(Index node) const noexcept { return static_cast<Index>(node * arity_); }
    /// 2 slabs rows of `arity` floats: lo, then minus_hi; inflated by where the vertices go, not by any distance.
    [[nodiscard]] const float* rows(Index node) const noexcept { return bounds_.data() + node * 2 * slabs_ * arity_; }
    /// The same of one slot, a float every `arity`.
    [[nodiscard]] const float* bounds(Index slot) const noexcept { return rows(static_cast<Index>(slot / arity_)) + slot % arity_; }
    /// m, longest side of the slot's bounds.
    [[nodiscard]] float longest_side(Index slot) const noexcept { return longest_[slot]; }
    [[nodiscard]] Index face_count(Index slot) const noexcept { return face_range_[slot].end - face_range_[slot].begin; }
    /// m, on top of d_close: the lazy tolerance and, for the plain inflation, the fastest vertex's way.
    [[nodiscard]] double constant_inflation() const noexcept { return constant_inflation_; }

    [[nodiscard]] const VelocityCone& velocity_cone(Index slot) const noexcept { return velocity_[slot]; }
    [[nodiscard]] const Cone& normal_cone(Index slot) const noexcept { return normals_[slot]; }
    [[nodiscard]] const FaceGroups& groups() const noexcept { return groups_; }
    /// Are all face groups beneath the slot adjacent to each other?
    [[nodiscard]] bool groups_agree(Index slot) const noexcept { return groups_agree_[slot] != 0; }
    /// Border of the slot's faces; empty where it is not one that a test can use.
    [[nodiscard]] ContourView contour(Index slot) const noexcept;

    [[nodiscard]] const RefitStats& refit_stats() const noexcept { return refit_stats_; }
    [[nodiscard]] std::size_t memory() const noexcept; // bytes

private:
    struct Range {
        Index begin = 0, end = 0;
    };
    void build_slot(const CutPlan& plan, Range range, Index slot);
    void mark_agreeing_groups();
    void make_contours();
    [[nodiscard]] std::span<const Index> faces(Index slot) const noexcept {
        return std::span(faces_).subspan(face_range_[slot].begin, face_count(slot));
    }

    void refit_vertices(const SurfaceMotion& motion);
    template <std::size_t Slabs>
    void refit_slots(const SurfaceMotion& motion);
    template <std::size_t Slabs, std::size_t Arity>
    void refit_slots_of(const SurfaceMotion& motion);
    template <std::size_t Slabs, std::size_t Arity>
    void refit_leaf(Index slot, Index face);
    template <std::size_t Slabs, std::size_t Arity>
    void refit_parent(Index slot, Index node);
    template <std::size_t Slabs, std::size_t Arity>
    void finish_bounds(Index slot);
    void refit_normal_cone(Index slot, Index child, const SurfaceMotion& motion);

    const SurfaceTopology* topology_ = nullptr;
    ProximityOptions options_;
    std::size_t arity_ = 0, slabs_ = 0;
    std::array<double, kMaxSlabs> lengths_{}; // of the directions, not below the true ones
    std::array<Vec3, kMaxSlabs> units_{};     // the directions
    bool self_ = false, oriented_ = false, keeps_velocities_ = false, keeps_normals_ = false;

    std::vector<Index> children_;            // [slot_count]
    std::vector<Index> faces_;               // triangle ids, those of a slot side by side
    std::vector<Range> face_range_;          // [slot_count] into faces_
    std::vector<float> bounds_, raw_;        // [node_count][2 slabs][arity]; raw_: before oriented inflation, else empty
    std::vector<float> longest_;             // [slot_count]
    std::vector<VelocityCone> velocity_;     // [slot_count]
    std::vector<Cone> normals_;              // [slot_count]
    std::vector<std::uint8_t> stale_;        // [slot_count] bounds were made anew in this refit
    std::vector<std::uint8_t> groups_agree_; // [slot_count]
    FaceGroups groups_;
    std::vector<Index> contour_begin_, contour_loop_begin_; // [slot_count + 1]
    std::vector<Index> contour_vertices_, contour_loop_ends_;

    std::vector<float> vertex_bounds_;          // [vertex_count][2 slabs]
    std::vector<VelocityCone> vertex_velocity_; // [vertex_count]
    std::vector<Vec3> held_t0_, held_t1_;       // [vertex_count] motion that the vertex' bounds were made for
    std::vector<std::uint8_t> vertex_stale_;    // [vertex_count]
    bool refitted_ = false;
    double constant_inflation_ = 0.0;
    RefitStats refit_stats_;
};

/// m, along a direction and against it.
struct Reach {
    double ahead = 0.0, behind = 0.0;
};
/// How far the vertices of a node reach out of where they are during the step. OrientedSafe: never less than any vertex does.
/// cosine   of the angle between the direction and the heading's axis
/// source   section 3.3; the formula is lost in the available scan of the paper, its text names the mean axis and the top speed.
///          OrientedSafe takes the half angle and the slow vertices into account as well, for the text's form holds no other vertex.
[[nodiscard]] Reach oriented_reach(const VelocityCone& cone, double cosine, Inflation inflation) noexcept;

} // namespace trocar::collision
