#include "collision/proximity/cone_tree.hpp"

#include "collision/bvh/tree_cuts.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace trocar::collision {
namespace {

constexpr float kNothing = SweptBox::kNothing;

/// Error that oriented_reach allows a cosine: near 1 the root of 1 - u^2 turns 1e-16 into 2e-8.
constexpr double kCosineError = 4e-8;

/// The cone of a face's normal during the step, by the Bernstein coefficients of the normal, which is quadratic in time. Faces so thin
/// that rounding could turn the normal by 1e-11 have no valid cone.
/// source   Tang, Curtis, Yoon, Manocha 2009, section 4
Cone cone_of_face(const Triangle& t, const SurfaceMotion& motion, bool during_step) noexcept {
    constexpr double kThinnest = 1e-4; // sine of the angle between two sides: a cross product is off by 10 u of their product
    const auto control = [](const Vec3& n, double size) { return n.norm() >= kThinnest * size ? Cone::around(n) : Cone::everything(); };
    const Vec3 a0 = motion.t0[t[1]] - motion.t0[t[0]], b0 = motion.t0[t[2]] - motion.t0[t[0]];
    const Cone start = control(a0.cross(b0), a0.norm() * b0.norm());
    if (!during_step) return start;
    const Vec3 a1 = motion.t1[t[1]] - motion.t1[t[0]], b1 = motion.t1[t[2]] - motion.t1[t[0]];
    const Cone middle = control(0.5 * (a0.cross(b1) + a1.cross(b0)), 0.5 * (a0.norm() * b1.norm() + a1.norm() * b0.norm()));
    return join(join(start, control(a1.cross(b1), a1.norm() * b1.norm())), middle);
}

} // namespace

Reach oriented_reach(const VelocityCone& cone, double cosine, Inflation inflation) noexcept {
    const bool has_direction = cone.heading.kind == Cone::Kind::Some;
    if (inflation == Inflation::OrientedPaper)
        return has_direction ? Reach{cone.fastest * std::max(0.0, cosine), cone.fastest * std::max(0.0, -cosine)} : Reach{};
    if (!has_direction) {
        const double all = cone.has_significant() ? std::max(cone.fastest, cone.slow) : cone.slow;
        return {all, all};
    }
    const double aside = std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) * cone.heading.sine;
    const auto one_way = [&](double u) {
        const double share = u >= cone.heading.cosine ? 1.0 : u * cone.heading.cosine + aside;
        return std::max(cone.slow, cone.fastest * std::clamp(share + kCosineError, 0.0, 1.0 + kCosineError));
    };
    return {one_way(cosine), one_way(-cosine)};
}

void ConeTree::build(const SurfaceTopology& topology, std::span<const Vec3> positions, const ProximityOptions& options, bool self) {
    assert(positions.size() == topology.vertex_count() && is_dop(options.dop));
    *this = ConeTree();
    topology_ = &topology;
    options_ = options;
    arity_ = options.arity;
    slabs_ = options.dop / 2;
    self_ = self;
    const Directions directions = directions_of(options.dop);
    for (std::size_t i = 0; i < directions.size(); ++i) {
        lengths_[i] = direction_length(directions[i]);
        units_[i] = Vec3(directions[i][0], directions[i][1], directions[i][2]) / lengths_[i];
    }
    oriented_ = options.during_step && (options.inflation == Inflation::OrientedPaper || options.inflation == Inflation::OrientedSafe);
    keeps_velocities_ = oriented_ || options.coherence == Coherence::VelocityCones;
    keeps_normals_ = self && options.normal_cones != NormalCones::Off;
    if (topology.triangles.empty()) return;
    const std::vector<CutItem> items = make_cut_items(topology.triangles, positions);
    faces_.resize(topology.triangles.size());
    std::iota(faces_.begin(), faces_.end(), Index{0});
    children_.assign(arity_, kNoIndex);
    face_range_.assign(arity_, {});
    build_slot({items, topology.triangles, positions, directions, TreeBuilder::Middle}, {0, static_cast<Index>(faces_.size())}, kRoot);
    const std::size_t slots = children_.size();
    bounds_.assign(slots * 2 * slabs_, kNothing);
    if (oriented_) raw_ = bounds_;
    longest_.assign(slots, 0.0f);
    velocity_.assign(keeps_velocities_ ? slots : 0, {});
    vertex_velocity_.assign(keeps_velocities_ ? topology.vertex_count() : 0, {});
    normals_.assign(keeps_normals_ ? slots : 0, {});
    stale_.assign(slots, 0);
    vertex_bounds_.assign(topology.vertex_count() * 2 * slabs_, kNothing);
    vertex_stale_.assign(topology.vertex_count(), 0);
    held_t0_.assign(positions.begin(), positions.end());
    held_t1_ = held_t0_;
    if (self && (options.normal_cones == NormalCones::Groups || options.leaf_angle > 0.0)) {
        groups_ = make_face_groups(topology, options.group_count);
        mark_agreeing_groups();
    }
    if (self && options.normal_cones == NormalCones::Contour) make_contours();
}

void ConeTree::build_slot(const CutPlan& plan, Range range, Index slot) {
    face_range_[slot] = range;
    if (range.end - range.begin == 1) {
        children_[slot] = faces_[range.begin] | kLeafBit;
        return;
    }
    const CutParts parts = cut_into_parts(plan, std::span(faces_).subspan(range.begin, range.end - range.begin), arity_, 1);
    const auto node = static_cast<Index>(children_.size() / arity_);
    children_[slot] = node;
    children_.resize(children_.size() + arity_, kNoIndex);
    face_range_.resize(children_.size(), Range{});
    Index begin = range.begin;
    for (std::size_t i = 0; i < parts.count; ++i) {
        const Index end = begin + static_cast<Index>(parts.part[i].size());
        build_slot(plan, {begin, end}, first_slot(node) + static_cast<Index>(i));
        begin = end;
    }
}

void ConeTree::mark_agreeing_groups() {
    groups_agree_.assign(children_.size(), 0);
    for (Index slot = 0; slot < children_.size(); ++slot) {
        std::uint64_t met = 0;
        for (const Index face : faces(slot)) met |= std::uint64_t{1} << groups_.of[face];
        groups_agree_[slot] = groups_.all_adjacent(met);
    }
}

void ConeTree::make_contours() {
    contour_begin_.assign(1, 0);
    contour_loop_begin_.assign(1, 0);
    Contour contour;
    for (Index slot = 0; slot < children_.size(); ++slot) {
        if (face_count(slot) > 1 && make_contour(*topology_, faces(slot), contour)) {
            contour_vertices_.insert(contour_vertices_.end(), contour.vertices.begin(), contour.vertices.end());
            contour_loop_ends_.insert(contour_loop_ends_.end(), contour.loop_ends.begin(), contour.loop_ends.end());
        }
        contour_begin_.push_back(static_cast<Index>(contour_vertices_.size()));
        contour_loop_begin_.push_back(static_cast<Index>(contour_loop_ends_.size()));
    }
}

ContourView ConeTree::contour(Index slot) const noexcept {
    if (contour_begin_.empty()) return {};
    const Index begin = contour_begin_[slot], loops = contour_loop_begin_[slot];
    return {std::span(contour_vertices_).subspan(begin, contour_begin_[slot + 1] - begin),
            std::span(contour_loop_ends_).subspan(loops, contour_loop_begin_[slot + 1] - loops)};
}

void ConeTree::refit(const SurfaceMotion& motion) {
    refit_stats_ = {};
    if (empty()) return;
    refit_vertices(motion);
    switch (slabs_) {
    case 3:
        return refit_slots<3>(motion);
    case 7:
        return refit_slots<7>(motion);
    case 9:
        return refit_slots<9>(motion);
    default:
        return refit_slots<13>(motion);
    }
}

/// Those that left the tolerance around the motion that their bounds were made for are stale. A vertex whose both ends are within it is
/// within it all the way.
void ConeTree::refit_vertices(const SurfaceMotion& motion) {
    const Directions directions = directions_of(options_.dop);
    const bool lazy = options_.lazy_tolerance > 0.0 && refitted_;
    const double tolerance_sq = options_.lazy_tolerance * options_.lazy_tolerance * (1.0 - 1e-12);
    const bool swept = options_.during_step && options_.inflation == Inflation::Swept;
    const bool plain = options_.during_step && options_.inflation == Inflation::Plain, moves = options_.during_step || keeps_velocities_;
    double fastest_sq = 0.0;
    for (std::size_t v = 0; v < held_t0_.size(); ++v) {
        const Vec3 &t0 = motion.t0[v], &t1 = moves ? motion.t1[v] : motion.t0[v];
        if (plain) fastest_sq = std::max(fastest_sq, (t1 - t0).squaredNorm());
        const bool stays = lazy && (t0 - held_t0_[v]).squaredNorm() <= tolerance_sq && (t1 - held_t1_[v]).squaredNorm() <= tolerance_sq;
        vertex_stale_[v] = !stays;
        if (stays) continue;
        held_t0_[v] = t0;
        held_t1_[v] = t1;
        float* bounds = vertex_bounds_.data() + v * 2 * slabs_;
        project_vertex(t0, swept ? t1 : t0, directions, bounds, bounds + slabs_);
        if (keeps_velocities_) vertex_velocity_[v] = make_velocity_cone(t1 - t0, options_.significance);
        ++refit_stats_.vertices;
    }
    refitted_ = true;
    constant_inflation_ = options_.lazy_tolerance;
    if (plain) constant_inflation_ += std::sqrt(fastest_sq) * (1.0 + 1e-12);
}

template <std::size_t Slabs>
void ConeTree::refit_slots(const SurfaceMotion& motion) {
    if (arity_ == 2) return refit_slots_of<Slabs, 2>(motion);
    if (arity_ == 4) return refit_slots_of<Slabs, 4>(motion);
    return refit_slots_of<Slabs, 8>(motion);
}

/// Children have higher slots than their parents.
template <std::size_t Slabs, std::size_t Arity>
void ConeTree::refit_slots_of(const SurfaceMotion& motion) {
    // an outline's proof is about the normals as they are; the others are as lazy as the bounds
    const bool normals_are_lazy = options_.normal_cones != NormalCones::Contour;
    for (auto slot = static_cast<Index>(children_.size()); slot-- > 0;) {
        const Index child = children_[slot];
        if (child == kNoIndex) continue;
        if (is_leaf(child))
            refit_leaf<Slabs, Arity>(slot, child & ~kLeafBit);
        else
            refit_parent<Slabs, Arity>(slot, child);
        if (keeps_normals_ && (stale_[slot] != 0 || !normals_are_lazy)) refit_normal_cone(slot, child, motion);
    }
}

template <std::size_t Slabs, std::size_t Arity>
void ConeTree::refit_leaf(Index slot, Index face) {
    const Triangle& t = topology_->triangles[face];
    stale_[slot] = vertex_stale_[t[0]] | vertex_stale_[t[1]] | vertex_stale_[t[2]];
    if (stale_[slot] == 0) return;
    const float *a = vertex_bounds_.data() + t[0] * 2 * Slabs, *b = vertex_bounds_.data() + t[1] * 2 * Slabs,
                *c = vertex_bounds_.data() + t[2] * 2 * Slabs;
    float* out = (oriented_ ? raw_ : bounds_).data() + slot / Arity * 2 * Slabs * Arity + slot % Arity;
    for (std::size_t s = 0; s < 2 * Slabs; ++s) {
        const float ab = a[s] < b[s] ? a[s] : b[s];
        out[s * Arity] = ab < c[s] ? ab : c[s];
    }
    if (keeps_velocities_) {
        velocity_[slot] = join(join(vertex_velocity_[t[0]], vertex_velocity_[t[1]]), vertex_velocity_[t[2]]);
        ++refit_stats_.velocity_cones;
    }
    finish_bounds<Slabs, Arity>(slot);
}

template <std::size_t Slabs, std::size_t Arity>
void ConeTree::refit_parent(Index slot, Index node) {
    const Index first = first_slot(node);
    stale_[slot] = 0;
    for (Index i = first; i < first + Arity; ++i)
        if (children_[i] != kNoIndex) stale_[slot] |= stale_[i];
    if (stale_[slot] == 0) return;
    auto& bounds = oriented_ ? raw_ : bounds_;
    const float* rows = bounds.data() + node * 2 * Slabs * Arity;
    float* out = bounds.data() + slot / Arity * 2 * Slabs * Arity + slot % Arity;
    for (std::size_t s = 0; s < 2 * Slabs; ++s) {
        float least = rows[s * Arity];
        for (std::size_t i = 1; i < Arity; ++i) least = rows[s * Arity + i] < least ? rows[s * Arity + i] : least;
        out[s * Arity] = least;
    }
    if (keeps_velocities_) {
        VelocityCone cone = velocity_[first];
        for (Index i = first + 1; i < first + Arity; ++i)
            if (children_[i] != kNoIndex) cone = join(cone, velocity_[i]);
        velocity_[slot] = cone;
        ++refit_stats_.velocity_cones;
    }
    finish_bounds<Slabs, Arity>(slot);
}

/// Oriented inflation, and the longest side of what comes out.
template <std::size_t Slabs, std::size_t Arity>
void ConeTree::finish_bounds(Index slot) {
    ++refit_stats_.slots;
    const Directions directions = directions_of(2 * Slabs);
    const std::size_t at = slot / Arity * 2 * Slabs * Arity + slot % Arity;
    float *lo = bounds_.data() + at, *minus_hi = lo + Slabs * Arity;
    if (oriented_) {
        const float *raw_lo = raw_.data() + at, *raw_minus_hi = raw_lo + Slabs * Arity;
        const VelocityCone& cone = velocity_[slot];
        for (std::size_t s = 0; s < Slabs; ++s) {
            const Reach reach = oriented_reach(cone, units_[s].dot(cone.heading.axis), options_.inflation);
            lo[s * Arity] = round_down(raw_lo[s * Arity] - lengths_[s] * reach.behind);
            minus_hi[s * Arity] = round_down(raw_minus_hi[s * Arity] - lengths_[s] * reach.ahead);
        }
    }
    float longest = 0.0f;
    for (std::size_t s = 0; s < Slabs; ++s) {
        const auto& n = directions[s];
        constexpr float kInverseRoots[] = {0.0f, 1.0f, 0.70710678f, 0.57735027f};
        const float side = -(lo[s * Arity] + minus_hi[s * Arity]) * kInverseRoots[n[0] * n[0] + n[1] * n[1] + n[2] * n[2]];
        longest = longest < side ? side : longest;
    }
    longest_[slot] = longest;
}

void ConeTree::refit_normal_cone(Index slot, Index child, const SurfaceMotion& motion) {
    ++refit_stats_.normal_cones;
    if (is_leaf(child)) {
        normals_[slot] = cone_of_face(topology_->triangles[child & ~kLeafBit], motion, options_.during_step);
        return;
    }
    Cone cone;
    const Index first = first_slot(child);
    for (Index i = first; i < first + arity_ && cone.kind != Cone::Kind::Everything; ++i)
        if (children_[i] != kNoIndex) cone = join(cone, normals_[i]);
    normals_[slot] = cone;
}

std::size_t ConeTree::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return bytes(children_) + bytes(faces_) + bytes(face_range_) + bytes(bounds_) + bytes(raw_) + bytes(longest_) + bytes(velocity_) +
           bytes(normals_) + bytes(stale_) + bytes(groups_agree_) + bytes(contour_begin_) + bytes(contour_loop_begin_) +
           bytes(contour_vertices_) + bytes(contour_loop_ends_) + bytes(vertex_bounds_) + bytes(vertex_velocity_) + bytes(held_t0_) +
           bytes(held_t1_) + bytes(vertex_stale_);
}

} // namespace trocar::collision
