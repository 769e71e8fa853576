#include "fem/rod/self_contact.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace trocar::fem {

namespace {

/// A push takes a node farther than it would have gone: by this factor, and at least by so much of the radius.
constexpr double kReachFactor = 2.0, kLeastReach = 0.2; // [-]
/// m/s, at which places that start nearer than they may be are parted.
constexpr double kParting = 2e-3;
/// Cosine above which a plane goes on with the forces of another one, and how far along the rod that may have been, in segments.
constexpr double kSameSide = 0.8, kSamePlace = 1.0;

double diameter(const RodModel& model) noexcept { return 2.0 * model.design.radius; }

std::array<Vec3, 4> corners_of(const SegmentPair& pair, std::span<const Vec3> axis) noexcept {
    return {axis[pair.a], axis[pair.a + 1], axis[pair.b], axis[pair.b + 1]};
}

RodPlane plane_of(const RodModel& model, const SegmentPair& pair, double step) noexcept {
    RodPlane plane;
    plane.node = pair.a, plane.weight = pair.s;
    plane.other = pair.b, plane.other_weight = pair.t;
    plane.normal = pair.normal;
    plane.offset = std::min((1.0 + kSelfClearance) * diameter(model), pair.distance + kParting * step);
    return plane;
}

double place_of(const RodPlane& plane) noexcept { return static_cast<double>(plane.node) + plane.weight; }
double other_place_of(const RodPlane& plane) noexcept { return static_cast<double>(plane.other) + plane.other_weight; }

/// m; nearer than this no motion may bring a pair: what starts nearer is not pressed deeper.
double nearest_allowed(const RodModel& model, double distance) noexcept {
    return std::min((1.0 - kSelfSlack) * diameter(model), distance * (1.0 - 1e-6));
}

} // namespace

void SelfContact::reserve(std::size_t nodes) {
    boxes_.reserve(nodes);
    reach_.reserve(nodes);
    pairs_.reserve(2 * kSelfPlanesPerNode * nodes); // half of them push elsewhere
    last_.reserve(kSelfPlanesPerNode * nodes);
    taken_.reserve(kSelfPlanesPerNode * nodes);
}

void SelfContact::begin(const RodModel& model, std::span<const Vec3> from, std::span<const Vec3> guess, double step) {
    begun_ = true, step_ = step, proven_share_ = 1.0;
    reach_.resize(from.size());
    for (std::size_t i = 0; i < from.size(); ++i)
        reach_[i] = kReachFactor * std::sqrt((guess[i] - from[i]).squaredNorm()) + kLeastReach * model.design.radius;
}

const SegmentPair* SelfContact::find_pair(Index a, Index b) const noexcept {
    const auto before = [](const SegmentPair& pair, std::pair<Index, Index> key) { return std::pair(pair.a, pair.b) < key; };
    const auto at = std::lower_bound(pairs_.begin(), pairs_.end(), std::pair(a, b), before);
    return at != pairs_.end() && at->a == a && at->b == b ? &*at : nullptr;
}

/// Two surfaces push where their distance is least on both sides: a nearest point at a segment's end is the neighbour's, where that goes on
/// to come nearer; and where it lies on both, the one that begins there has it.
bool SelfContact::is_pushed_elsewhere(std::size_t k) const noexcept {
    const SegmentPair& pair = pairs_[k];
    if (pair.s >= 1.0 && find_pair(pair.a + 1, pair.b) != nullptr) return true;
    if (pair.t >= 1.0 && find_pair(pair.a, pair.b + 1) != nullptr) return true;
    if (pair.s <= 0.0 && pair.a > 0)
        if (const SegmentPair* before = find_pair(pair.a - 1, pair.b); before != nullptr && before->s < 1.0) return true;
    if (pair.t <= 0.0)
        if (const SegmentPair* before = find_pair(pair.a, pair.b - 1); before != nullptr && before->t < 1.0) return true;
    return false;
}

void SelfContact::hand_on(RodPlane& plane) {
    const auto first = std::lower_bound(last_.begin(), last_.end(), plane.node > 0 ? plane.node - 1 : 0,
                                        [](const RodPlane& a, Index node) { return a.node < node; });
    std::size_t best = last_.size();
    double nearest = 2.0 * kSamePlace;
    for (auto at = first; at != last_.end() && at->node <= plane.node + 1; ++at) {
        const auto k = static_cast<std::size_t>(at - last_.begin());
        if (taken_[k] != 0 || !(at->normal.dot(plane.normal) > kSameSide)) continue;
        const double along = std::abs(place_of(*at) - place_of(plane)), other = std::abs(other_place_of(*at) - other_place_of(plane));
        if (along > kSamePlace || other > kSamePlace || !(along + other < nearest)) continue;
        nearest = along + other, best = k;
    }
    if (best == last_.size()) return;
    taken_[best] = 1;
    plane.force = plane.start_force = last_[best].start_force;
    plane.drag = plane.start_drag = last_[best].start_drag - plane.normal.dot(last_[best].start_drag) * plane.normal;
}

void SelfContact::list_planes(const RodModel& model, std::span<const Vec3> from, std::span<const Vec3> guess, std::vector<RodPlane>& planes) {
    last_.clear();
    for (const RodPlane& plane : planes)
        if (plane.start_force > 0.0) last_.push_back(plane);
    std::sort(last_.begin(), last_.end(), [](const RodPlane& a, const RodPlane& b) {
        return std::tuple(a.node, a.other, a.weight, a.other_weight) < std::tuple(b.node, b.other, b.weight, b.other_weight);
    });
    taken_.assign(last_.size(), 0);
    boxes_.find_pairs(from, {model.design.radius, model.segment}, (1.0 + kSelfClearance) * diameter(model), reach_, pairs_);
    planes.clear();
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
        if (is_pushed_elsewhere(k)) continue;
        planes.push_back(plane_of(model, pairs_[k], step_));
        hand_on(planes.back());
    }
    for (const SegmentPair& pair : pairs_) (void)add_met(model, pair, from, guess, planes);
}

bool SelfContact::check(const RodModel& model, std::span<const Vec3> from, std::span<const Vec3> to, std::vector<RodPlane>& planes) {
    proven_share_ = 1.0;
    bool left_reach = false;
    for (std::size_t i = 0; i < from.size(); ++i) {
        const double way = std::sqrt((to[i] - from[i]).squaredNorm());
        if (way <= reach_[i]) continue;
        proven_share_ = std::min(proven_share_, reach_[i] / way);
        reach_[i] = kReachFactor * way;
        left_reach = true;
    }
    if (left_reach) {
        list_planes(model, from, to, planes);
        return false;
    }
    const std::size_t known = planes.size();
    for (const SegmentPair& pair : pairs_) proven_share_ = std::min(proven_share_, add_met(model, pair, from, to, planes));
    return proven_share_ >= 1.0 || planes.size() == known;
}

/// Returns the share of the motion that is proven; where that is not all, a plane across the nearest points of where they would have met,
/// which holds from the start on.
double SelfContact::add_met(const RodModel& model, const SegmentPair& pair, std::span<const Vec3> from, std::span<const Vec3> to,
                            std::vector<RodPlane>& planes) const {
    const std::array<Vec3, 4> start = corners_of(pair, from), end = corners_of(pair, to);
    const double share = share_apart(start, end, nearest_allowed(model, pair.distance));
    if (share >= 1.0) return share;
    std::array<Vec3, 4> met;
    for (std::size_t c = 0; c < 4; ++c) met[c] = (1.0 - share) * start[c] + share * end[c];
    SegmentPair there = nearest_on_pair(pair.a, pair.b, met);
    there.distance = there.normal.dot((1.0 - there.s) * start[0] + there.s * start[1] - (1.0 - there.t) * start[2] - there.t * start[3]);
    if (there.distance > 0.0) planes.push_back(plane_of(model, there, step_));
    return share;
}

} // namespace trocar::fem
