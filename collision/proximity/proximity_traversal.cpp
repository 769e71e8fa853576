#include "collision/proximity/proximity_traversal.hpp"

#include "base/trig.hpp"
#include "collision/culling/chromatic_sets.hpp"
#include "collision/bvh/near_pairs.hpp"

#include <algorithm>
#include <utility>

namespace trocar::collision {
namespace {

/// Faces beneath a pair of nodes whose results are kept together: fewer cost as much to look up as to test, more move too much.
constexpr Index kRecordedFaces = 48;

/// What is added to every reach, as a share of the largest coordinate: rounding of a distance between faces, and of the sweeps that
/// find it, is below 1e-13 of their extent; so no box ever drops a pair that the faces' own test would call near.
constexpr double kReachRounding = 1e-12;

} // namespace

void ProximityStats::add(const ProximityStats& part) noexcept {
    box_tests += part.box_tests;
    face_tests += part.face_tests;
    near += part.near;
    cone_skips += part.cone_skips;
    contour_tests += part.contour_tests;
    angle_skips += part.angle_skips;
    list_pairs += part.list_pairs;
    kept_nodes += part.kept_nodes;
    kept_near += part.kept_near;
}

void ProximityTraversal::build(const ProximityOptions& options, std::size_t arity) {
    *this = ProximityTraversal();
    options_ = options;
    flat_cosine_ = sin_cos(options.cone_half_angle).cos;
    leaf_cosine_ = sin_cos(options.leaf_angle).cos;
    stack_.reserve(64 * arity);
}

void ProximityTraversal::find(const ProximitySide& a, const ProximitySide& b, double coordinate, std::vector<Proximity>& out) {
    stats_ = {};
    a_ = a;
    b_ = b;
    if (a.tree->empty() || b.tree->empty()) return;
    set_reach(coordinate);
    results_.clear();
    const bool listed = options_.coherence == Coherence::SeparationList;
    std::swap(list_, old_list_);
    list_.clear();
    if (listed && list_age_ > 0 && list_age_ < options_.rebuild_after) {
        start_from_list();
        ++list_age_;
    } else {
        start_from_root();
        list_age_ = listed ? 1 : 0;
    }
    stats_.list_pairs = list_.size();
    stats_.near = results_.size();
    out.insert(out.end(), results_.begin(), results_.end());
    finish_records();
}

void ProximityTraversal::set_reach(double coordinate) {
    distance_ = within() ? options_.self_distance : options_.distance;
    const double reach = distance_ * (1.0 + 2.0 * kProximityTolerance) + a_.tree->constant_inflation() + b_.tree->constant_inflation() +
                         kReachRounding * coordinate;
    const Directions directions = directions_of(options_.dop);
    for (std::size_t s = 0; s < directions.size(); ++s) reach_[s] = round_up(reach * direction_length(directions[s]));
}

void ProximityTraversal::start_from_root() {
    const SlotPair roots{ConeTree::kRoot, ConeTree::kRoot};
    if (within() || is_near(roots))
        take_near(roots);
    else
        stop_at(roots);
    run();
}

/// The list cuts every path from the roots to a pair of faces, so what is near lies beneath one of its pairs. It only moves down.
void ProximityTraversal::start_from_list() {
    for (const SlotPair& at : old_list_) {
        if ((within() && at.a == at.b) || is_near(at))
            take_near(at);
        else
            stop_at(at);
        run();
    }
}

void ProximityTraversal::run() {
    while (!stack_.empty()) {
        const SlotPair at = stack_.back();
        stack_.pop_back();
        if (is_recorded(at))
            open_recorded(at);
        else
            open(at);
    }
}

void ProximityTraversal::open(SlotPair at) {
    if (within() && at.a == at.b)
        open_self(at.a);
    else
        open_pair(at);
}

/// Where the recursion ends, for the next step to begin.
void ProximityTraversal::stop_at(SlotPair at) {
    if (options_.coherence == Coherence::SeparationList) list_.push_back(at);
}

void ProximityTraversal::take_near(SlotPair at) {
    const Index child_a = a_.tree->child(at.a), child_b = b_.tree->child(at.b);
    if (!ConeTree::is_leaf(child_a) || !ConeTree::is_leaf(child_b)) return stack_.push_back(at);
    if (within() && at.a == at.b) return; // a face is not tested against itself
    stop_at(at);
    test_faces(child_a & ~ConeTree::kLeafBit, child_b & ~ConeTree::kLeafBit);
}

std::uint32_t ProximityTraversal::near_children_of(const ConeTree& tree, Index node, const ConeTree& other_tree, Index other) {
    const auto test = options_.simd ? near_children : near_children_plain;
    return test(other_tree.bounds(other), other_tree.arity(), tree.rows(node), tree.arity(), tree.slabs(), reach_.data());
}

/// Children against themselves, and each against those after it.
void ProximityTraversal::open_self(Index slot) {
    if (skips_itself(slot)) return stop_at({slot, slot});
    const ConeTree& tree = *a_.tree;
    const Index node = tree.child(slot), first = tree.first_slot(node);
    for (Index i = 0; i < tree.arity(); ++i) {
        if (tree.child(first + i) == kNoIndex) continue;
        take_near({first + i, first + i});
        const std::uint32_t near = near_children_of(tree, node, tree, first + i);
        for (Index k = i + 1; k < tree.arity(); ++k) {
            if (tree.child(first + k) == kNoIndex) continue;
            ++stats_.box_tests;
            if ((near >> k & 1u) != 0)
                take_near({first + i, first + k});
            else
                stop_at({first + i, first + k});
        }
    }
}

/// "All children inside the longer k-DOP are tested against the shorter one."
void ProximityTraversal::open_pair(SlotPair at) {
    const bool a_is_leaf = ConeTree::is_leaf(a_.tree->child(at.a)), b_is_leaf = ConeTree::is_leaf(b_.tree->child(at.b));
    const bool opens_a = b_is_leaf || (!a_is_leaf && a_.tree->longest_side(at.a) >= b_.tree->longest_side(at.b));
    const ConeTree &opened = opens_a ? *a_.tree : *b_.tree, &other = opens_a ? *b_.tree : *a_.tree;
    const Index node = opened.child(opens_a ? at.a : at.b), first = opened.first_slot(node);
    const std::uint32_t near = near_children_of(opened, node, other, opens_a ? at.b : at.a);
    for (Index i = 0; i < opened.arity(); ++i) {
        if (opened.child(first + i) == kNoIndex) continue;
        ++stats_.box_tests;
        const SlotPair next = opens_a ? SlotPair{first + i, at.b} : SlotPair{at.a, first + i};
        if ((near >> i & 1u) != 0)
            take_near(next);
        else
            stop_at(next);
    }
}

bool ProximityTraversal::is_near(SlotPair at) noexcept {
    ++stats_.box_tests;
    const float *a = a_.tree->bounds(at.a), *b = b_.tree->bounds(at.b);
    const std::size_t slabs = a_.tree->slabs(), stride = a_.tree->arity();
    for (std::size_t s = 0; s < slabs; ++s)
        if (a[s * stride] + b[(s + slabs) * stride] > reach_[s] || a[(s + slabs) * stride] + b[s * stride] > reach_[s]) return false;
    return true;
}

bool ProximityTraversal::skips_itself(Index slot) {
    if (options_.normal_cones == NormalCones::Off) return false;
    const ConeTree& tree = *a_.tree;
    const Cone& cone = tree.normal_cone(slot);
    if (cone.kind != Cone::Kind::Some) return false;
    bool skips = false;
    if (options_.normal_cones == NormalCones::Contour) {
        const ContourView contour = tree.contour(slot);
        if (contour.vertices.empty()) return false;
        ++stats_.contour_tests;
        const SurfaceMotion now{a_.motion.topology, a_.motion.t0, a_.motion.t0};
        skips = contour_test_.is_simple(contour, options_.during_step ? a_.motion : now, cone.axis);
    } else {
        skips = cone.cosine >= flat_cosine_ && (options_.normal_cones == NormalCones::Alone || tree.groups_agree(slot));
    }
    stats_.cone_skips += skips;
    return skips;
}

/// Two faces of one group or adjacent ones whose normals differ little, at t0 (section 6.2).
bool ProximityTraversal::looks_flat(Index face_a, Index face_b) const noexcept {
    const FaceGroups& groups = a_.tree->groups();
    if ((groups.adjacent[groups.of[face_a]] >> groups.of[face_b] & 1u) == 0) return false;
    const auto normal_of = [&](Index face) -> Vec3 {
        const Triangle& t = a_.tree->topology().triangles[face];
        return (a_.motion.t0[t[1]] - a_.motion.t0[t[0]]).cross(a_.motion.t0[t[2]] - a_.motion.t0[t[0]]);
    };
    const Vec3 na = normal_of(face_a), nb = normal_of(face_b);
    return na.dot(nb) >= leaf_cosine_ * na.norm() * nb.norm();
}

SweptFace ProximityTraversal::corners_of(const ProximitySide& side, Index face) const noexcept {
    const Triangle& t = side.tree->topology().triangles[face];
    const auto &t0 = side.motion.t0, &t1 = side.motion.t1;
    return {{t0[t[0]], t0[t[1]], t0[t[2]]}, {t1[t[0]], t1[t[1]], t1[t[2]]}};
}

void ProximityTraversal::test_faces(Index face_a, Index face_b) {
    if (within()) {
        const auto& triangles = a_.tree->topology().triangles;
        if (are_adjacent(triangles[face_a], triangles[face_b])) return;
        if (face_b < face_a) std::swap(face_a, face_b);
        if (options_.leaf_angle > 0.0 && looks_flat(face_a, face_b)) {
            ++stats_.angle_skips;
            return;
        }
    }
    ++stats_.face_tests;
    Proximity near{.surface_a = a_.surface, .surface_b = b_.surface, .face_a = face_a, .face_b = face_b, .found = {}};
    const SweptFace a = corners_of(a_, face_a), b = corners_of(b_, face_b);
    const bool found = options_.leaf_test == LeafTest::Faces
                           ? find_face_proximity(a, b, distance_, options_.during_step, near.found)
                           : find_vertex_proximity(a, b, distance_, options_.during_step, within(), near.found);
    if (found) results_.push_back(near);
}

/// The highest pairs of nodes on a path that are small enough; what lies beneath them is in their record.
bool ProximityTraversal::is_recorded(SlotPair at) const noexcept {
    return options_.coherence == Coherence::VelocityCones && a_.tree->face_count(at.a) + b_.tree->face_count(at.b) <= kRecordedFaces;
}

const ProximityTraversal::Record* ProximityTraversal::find_record(SlotPair at) const noexcept {
    const auto found =
        std::lower_bound(old_records_.begin(), old_records_.end(), at, [](const Record& r, SlotPair key) { return r.at < key; });
    return found != old_records_.end() && found->at == at ? &*found : nullptr;
}

void ProximityTraversal::open_recorded(SlotPair at) {
    // velocities may be as old as the lazy tolerance lets them: each end of a way is within it
    const double now = relative_motion_bound(a_.tree->velocity_cone(at.a), b_.tree->velocity_cone(at.b)) + 4.0 * options_.lazy_tolerance;
    Record record{at, results_.size(), 0, now};
    const Record* old = find_record(at);
    const double so_far = old != nullptr ? old->travelled + a_.strayed + b_.strayed : 0.0;
    if (old != nullptr && so_far + now <= options_.reuse_limit) {
        keep_results(*old);
        record.travelled = so_far + now;
        ++stats_.kept_nodes;
    } else {
        const std::size_t base = stack_.size();
        open(at);
        while (stack_.size() > base) {
            const SlotPair next = stack_.back();
            stack_.pop_back();
            open(next);
        }
    }
    record.end = results_.size();
    records_.push_back(record);
}

/// The same points of the faces, where they are now. Those whose points are not as near any more are left out.
void ProximityTraversal::keep_results(const Record& record) {
    for (std::size_t i = record.begin; i < record.end; ++i) {
        Proximity near = old_results_[i];
        const SweptFace a = corners_of(a_, near.face_a), b = corners_of(b_, near.face_b);
        FacePoints& points = near.found.points;
        const auto apart = [&](const FaceCorners& of_a, const FaceCorners& of_b) {
            Vec3 between = Vec3::Zero();
            for (std::size_t k = 0; k < 3; ++k) between += points.bary_a[k] * of_a[k] - points.bary_b[k] * of_b[k];
            return between.norm();
        };
        points.distance = apart(a.t0, b.t0);
        near.found.time = 0.0;
        if (points.distance > distance_ && options_.during_step) {
            points.distance = apart(a.t1, b.t1);
            near.found.time = 1.0;
        }
        if (points.distance > distance_) continue;
        near.kept = true;
        results_.push_back(near);
        ++stats_.kept_near;
    }
}

void ProximityTraversal::finish_records() {
    if (options_.coherence != Coherence::VelocityCones) return;
    std::sort(records_.begin(), records_.end(), [](const Record& x, const Record& y) { return x.at < y.at; });
    std::swap(records_, old_records_);
    std::swap(results_, old_results_);
    records_.clear();
}

std::size_t ProximityTraversal::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return bytes(stack_) + bytes(list_) + bytes(old_list_) + bytes(records_) + bytes(old_records_) + bytes(results_) + bytes(old_results_);
}

} // namespace trocar::collision
