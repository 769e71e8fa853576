#include "fem/rod/rod_meetings.hpp"

#include "fem/rod/bore_contact.hpp"
#include "fem/rod/coaxial.hpp"
#include "fem/rod/self_contact.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace trocar::fem {

namespace {

/// A push takes a node farther than it would have gone: by this factor, and at least by so much of the radius.
constexpr double kMeetingReachFactor = 2.0, kLeastMeetingReach = 0.2; // [-]
/// m/s, at which rods that start nearer than they may be are parted.
constexpr double kMeetingParting = 2e-3;
/// [-] of the play, and m: a solve that ends farther beyond a bore than both together is made again.
constexpr double kBoreSlack = 2e-2, kLeastBoreSlack = 1e-6;
/// Cosine above which a plane goes on with the forces of another one, and how far along the rods that may have been, in segments.
constexpr double kSameMeetingSide = 0.8, kSameMeetingPlace = 1.0;

std::array<Vec3, 4> corners_between(const SegmentPair& pair, std::span<const Vec3> one, std::span<const Vec3> other) noexcept {
    return {one[pair.a], one[pair.a + 1], other[pair.b], other[pair.b + 1]};
}

double radii_of(const MovedRod& one, const MovedRod& other) noexcept { return one.model->design.radius + other.model->design.radius; }

/// rods[k] with this id.
std::size_t find_rod(std::span<const MovedRod> rods, Index id) noexcept {
    std::size_t k = 0;
    while (k + 1 < rods.size() && rods[k].id != id) ++k;
    return k;
}

/// Is the axis from one segment to the other, by the bore's mouth, shorter than pi times the sum of radii? See ChainRule.
bool is_beside_mouth(const MovedRod& outer, const MovedRod& inner, Index a, Index b) noexcept {
    const double behind = static_cast<double>(outer.model->node_count() - 2 - a) * outer.model->segment;
    const double beyond = inner.insertion - static_cast<double>(inner.model->node_count() - 1 - b) * inner.model->segment - outer.insertion;
    return behind + std::max(0.0, beyond) < std::numbers::pi * radii_of(outer, inner);
}


} // namespace

void RodMeetings::reserve(std::size_t nodes) {
    for (ChainBoxes& boxes : boxes_) boxes.reserve(nodes);
    for (std::vector<double>& reach : reach_) reach.reserve(nodes);
    found_.reserve(2 * kMeetingsPerNode * nodes);
    pairs_.reserve(2 * kMeetingsPerNode * nodes); // half of them push elsewhere
    last_.reserve(kMeetingsPerNode * nodes);
    taken_.reserve(kMeetingsPerNode * nodes);
}

void RodMeetings::begin(std::span<const MovedRod> rods, double step) {
    step_ = step;
    listed_again_ = false;
    for (std::size_t r = 0; r < rods.size(); ++r) {
        const MovedRod& rod = rods[r];
        reach_[r].resize(rod.from.size());
        for (std::size_t i = 0; i < rod.from.size(); ++i)
            reach_[r][i] = kMeetingReachFactor * std::sqrt((rod.to[i] - rod.from[i]).squaredNorm()) + kLeastMeetingReach * rod.model->design.radius;
    }
    in_bore_.fill(false);
    for (std::size_t r = 0; r < rods.size(); ++r) {
        first_[r] = rods[r].first;
        if (rods[r].inside == kNoIndex) continue;
        const std::size_t outer = find_rod(rods, rods[r].inside);
        in_bore_[r] = in_bore_[outer] = true;
        first_[r] = std::max(first_[r], first_free_node(*rods[r].model, rods[r].insertion, rods[outer].insertion));
    }
    find_pairs(rods);
}

void RodMeetings::find_pairs(std::span<const MovedRod> rods) {
    pairs_.clear();
    for (std::size_t r = 0; r < rods.size(); ++r) boxes_[r].bound(rods[r].from, reach_[r], first_[r] > 0 ? first_[r] - 1 : 0);
    for (Index one = 0; one < rods.size(); ++one)
        for (Index other = one + 1; other < rods.size(); ++other)
            if (rods[one].meets && rods[other].meets && rods[one].lumen == rods[other].lumen) find_pairs_of(rods, one, other);
}

/// What is behind its port lies in its sheath and meets nothing; what lies in the port meets what has come out of others. What comes out of a bore meets
/// the rod around it where it has room to bend back to it.
void RodMeetings::find_pairs_of(std::span<const MovedRod> rods, Index one, Index other) {
    const MovedRod &a = rods[one], &b = rods[other];
    found_.clear();
    boxes_[one].find_pairs_with(boxes_[other], (1.0 + kSelfClearance) * radii_of(a, b), found_);
    const bool in_its_bore = b.inside == a.id;
    for (const SegmentPair& pair : found_) {
        if (in_its_bore && is_beside_mouth(a, b, pair.a, pair.b)) continue;
        if (pair.a + 1 != a.first || pair.b + 1 != b.first) pairs_.push_back({pair, one, other});
    }
}

bool RodMeetings::may_meet(std::size_t k) const noexcept {
    return in_bore_[k] || std::any_of(pairs_.begin(), pairs_.end(), [&](const Pair& pair) { return pair.one == k || pair.other == k; });
}

const RodMeetings::Pair* RodMeetings::find_pair(const Pair& like, Index a, Index b) const noexcept {
    const auto key = std::tuple(like.one, like.other, a, b);
    const auto key_of = [](const Pair& p) { return std::tuple(p.one, p.other, p.at.a, p.at.b); };
    const auto at = std::lower_bound(pairs_.begin(), pairs_.end(), key, [&](const Pair& p, const auto& k) { return key_of(p) < k; });
    return at != pairs_.end() && key_of(*at) == key ? &*at : nullptr;
}

/// Two surfaces push where their distance is least on both sides: see SelfContact.
bool RodMeetings::is_pushed_elsewhere(const Pair& pair) const noexcept {
    const SegmentPair& at = pair.at;
    if (at.s >= 1.0 && find_pair(pair, at.a + 1, at.b) != nullptr) return true;
    if (at.t >= 1.0 && find_pair(pair, at.a, at.b + 1) != nullptr) return true;
    if (at.s <= 0.0 && at.a > 0)
        if (const Pair* before = find_pair(pair, at.a - 1, at.b); before != nullptr && before->at.s < 1.0) return true;
    if (at.t <= 0.0 && at.b > 0)
        if (const Pair* before = find_pair(pair, at.a, at.b - 1); before != nullptr && before->at.t < 1.0) return true;
    return false;
}

RodMeeting RodMeetings::plane_of(std::span<const MovedRod> rods, const Pair& pair) const noexcept {
    RodMeeting meeting;
    meeting.rod = rods[pair.one].id, meeting.other_rod = rods[pair.other].id;
    meeting.plane.node = pair.at.a, meeting.plane.weight = pair.at.s;
    meeting.plane.other = pair.at.b, meeting.plane.other_weight = pair.at.t;
    meeting.plane.normal = pair.at.normal;
    meeting.plane.offset = std::min((1.0 + kSelfClearance) * radii_of(rods[pair.one], rods[pair.other]), pair.at.distance + kMeetingParting * step_);
    return meeting;
}

void RodMeetings::hand_on(RodMeeting& meeting) {
    RodPlane& plane = meeting.plane;
    const auto place = [](const RodPlane& p) { return static_cast<double>(p.node) + p.weight; };
    const auto other_place = [](const RodPlane& p) { return static_cast<double>(p.other) + p.other_weight; };
    std::size_t best = last_.size();
    double nearest = 2.0 * kSameMeetingPlace;
    for (std::size_t k = 0; k < last_.size(); ++k) {
        const RodPlane& old = last_[k].plane;
        if (taken_[k] != 0 || last_[k].play > 0.0 || last_[k].rod != meeting.rod || last_[k].other_rod != meeting.other_rod) continue;
        const double along = std::abs(place(old) - place(plane)), other = std::abs(other_place(old) - other_place(plane));
        if (along > kSameMeetingPlace || other > kSameMeetingPlace || !(along + other < nearest) || !(old.normal.dot(plane.normal) > kSameMeetingSide)) continue;
        nearest = along + other, best = k;
    }
    if (best == last_.size()) return;
    taken_[best] = 1;
    plane.force = plane.start_force = last_[best].plane.start_force;
    plane.drag = plane.start_drag = last_[best].plane.start_drag - plane.normal.dot(last_[best].plane.start_drag) * plane.normal;
}

void RodMeetings::list_planes(std::span<const MovedRod> rods, std::vector<RodMeeting>& meetings) {
    last_.clear();
    for (const RodMeeting& meeting : meetings)
        if (meeting.plane.start_force > 0.0) last_.push_back(meeting);
    taken_.assign(last_.size(), 0);
    meetings.clear();
    for (const Pair& pair : pairs_) {
        if (is_pushed_elsewhere(pair)) continue;
        meetings.push_back(plane_of(rods, pair));
        hand_on(meetings.back());
    }
    for (const Pair& pair : pairs_) (void)prove(rods, pair, &meetings);
    for (const MovedRod& inner : rods)
        if (inner.inside != kNoIndex) list_bore(rods[find_rod(rods, inner.inside)], inner, last_, meetings);
}

/// Returns whether a node left its reach: it has a longer one now, and pairs are found anew.
bool RodMeetings::lengthen_reaches(std::span<const MovedRod> rods) {
    bool left = false;
    for (std::size_t r = 0; r < rods.size(); ++r)
        for (std::size_t i = 0; i < rods[r].from.size(); ++i) {
            const double way = std::sqrt((rods[r].to[i] - rods[r].from[i]).squaredNorm());
            if (way <= reach_[r][i]) continue;
            reach_[r][i] = kMeetingReachFactor * way;
            left = true;
        }
    if (left) find_pairs(rods);
    return left;
}

bool RodMeetings::check(std::span<const MovedRod> rods, bool settled, std::vector<RodMeeting>& meetings) {
    if (lengthen_reaches(rods)) {
        list_planes(rods, meetings);
        return false;
    }
    if (settled && !listed_again_ && leaves_bore(rods, meetings)) {
        listed_again_ = true;
        for (RodMeeting& meeting : meetings) // of a limit that is new: the next solve begins with what this one came to
            if (meeting.play > 0.0 && meeting.plane.start_force == 0.0) meeting.plane.start_force = meeting.plane.force, meeting.plane.start_drag = meeting.plane.drag;
        list_planes(rods, meetings);
        return false;
    }
    const std::size_t known = meetings.size();
    for (const Pair& pair : pairs_) (void)prove(rods, pair, &meetings);
    return meetings.size() == known;
}

bool RodMeetings::leaves_bore(std::span<const MovedRod> rods, std::span<const RodMeeting> meetings) noexcept {
    return std::any_of(meetings.begin(), meetings.end(), [&](const RodMeeting& meeting) {
        if (!(meeting.play > 0.0)) return false;
        const double excess = find_bore_excess(meeting, rods[find_rod(rods, meeting.rod)].to, rods[find_rod(rods, meeting.other_rod)].to);
        return excess > kBoreSlack * meeting.play + kLeastBoreSlack;
    });
}

double RodMeetings::find_proven_share(std::span<const MovedRod> rods) {
    (void)lengthen_reaches(rods);
    double share = 1.0;
    for (const Pair& pair : pairs_) share = std::min(share, prove(rods, pair, nullptr));
    return share;
}

/// Returns the share of the motion that is proven; where that is not all, adds a plane across the nearest points of where they would have
/// met, which holds from the start on. Rods that start nearer than they may be are not pressed deeper than where they are deepest: as one slides
/// through the other one's place, the next segments come as deep.
double RodMeetings::prove(std::span<const MovedRod> rods, const Pair& pair, std::vector<RodMeeting>* meetings) const {
    const MovedRod &one = rods[pair.one], &other = rods[pair.other];
    const std::array<Vec3, 4> start = corners_between(pair.at, one.from, other.from), end = corners_between(pair.at, one.to, other.to);
    const double apart = (1.0 - kSelfSlack) * radii_of(one, other);
    double share = share_apart(start, end, std::min(apart, pair.at.distance * (1.0 - 1e-6)));
    if (share < 1.0) {
        double deepest = apart;
        for (const Pair& near : pairs_)
            if (near.one == pair.one && near.other == pair.other) deepest = std::min(deepest, near.at.distance * (1.0 - 1e-6));
        if (deepest < (1.0 - 2.0 * kSelfSlack) * apart) share = share_apart(start, end, deepest);
    }
    if (share >= 1.0 || meetings == nullptr) return share;
    std::array<Vec3, 4> met;
    for (std::size_t c = 0; c < 4; ++c) met[c] = (1.0 - share) * start[c] + share * end[c];
    Pair there{nearest_on_pair(pair.at.a, pair.at.b, met), pair.one, pair.other};
    SegmentPair& at = there.at;
    at.distance = at.normal.dot((1.0 - at.s) * start[0] + at.s * start[1] - (1.0 - at.t) * start[2] - at.t * start[3]);
    if (at.distance > 0.0) meetings->push_back(plane_of(rods, there));
    return share;
}

} // namespace trocar::fem
