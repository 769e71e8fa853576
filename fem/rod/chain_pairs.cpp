#include "fem/rod/chain_pairs.hpp"

#include "base/closest_point.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::fem {

namespace {

constexpr Index kLeafSegments = 4;
/// Planes that follow one another in one motion; what they do not get through is not proven.
constexpr int kMostPlanes = 64;
/// m; a chain that touches itself nowhere lets its segments cross at a point: those have a normal all the same.
constexpr double kOnePoint = 1e-12;

/// m^2, between boxes.
double distance_sq(const Box3& a, const Box3& b) noexcept {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double apart = std::max({0.0, a.lo[axis] - b.hi[axis], b.lo[axis] - a.hi[axis]});
        sum += apart * apart;
    }
    return sum;
}

/// Unit, across both directions; where they are parallel across the first.
Vec3 across(const Vec3& a, const Vec3& b) noexcept {
    Vec3 normal = a.cross(b);
    for (int axis = 0; axis < 3 && !(normal.squaredNorm() > kOnePoint * a.squaredNorm() * b.squaredNorm()); ++axis)
        normal = a.cross(Vec3::Unit(axis));
    const double length = std::sqrt(normal.squaredNorm());
    return length > 0.0 ? Vec3(normal / length) : Vec3(Vec3::UnitX());
}

} // namespace

Index ChainRule::least_gap() const noexcept {
    const double between = std::ceil(std::numbers::pi * radius / segment * (1.0 - 1e-9));
    return static_cast<Index>(std::max(2.0, 1.0 + between));
}

SegmentPair nearest_on_pair(Index a, Index b, const std::array<Vec3, 4>& c) noexcept {
    const PointsOnSegments on = closest_on_segments({c[0], c[1]}, {c[2], c[3]});
    const Vec3 way = (1.0 - on.s) * c[0] + on.s * c[1] - ((1.0 - on.t) * c[2] + on.t * c[3]);
    const double distance = std::sqrt(way.squaredNorm());
    return {a, b, on.s, on.t, distance > kOnePoint ? Vec3(way / distance) : across(c[1] - c[0], c[3] - c[2]), distance};
}

double share_apart(const std::array<Vec3, 4>& from, const std::array<Vec3, 4>& to, double limit) noexcept {
    double share = 0.0;
    std::array<Vec3, 4> now = from;
    for (int round = 0; round < kMostPlanes; ++round) {
        const SegmentPair near = nearest_on_pair(0, 0, now);
        if (!(near.distance >= limit)) return share;
        double lasts = 1.0 - share; // the plane, until a corner of a comes within the limit of one of b
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t j = 2; j < 4; ++j) {
                const double gap = near.normal.dot(now[i] - now[j]) - limit;
                const double rate = near.normal.dot((to[i] - from[i]) - (to[j] - from[j]));
                if (rate < 0.0) lasts = std::min(lasts, std::max(0.0, gap) / -rate);
            }
        if (share + lasts >= 1.0) return 1.0;
        if (!(lasts > 1e-9)) return share;
        share += lasts;
        for (std::size_t k = 0; k < 4; ++k) now[k] = (1.0 - share) * from[k] + share * to[k];
    }
    return share;
}

void ChainBoxes::find_pairs(std::span<const Vec3> axis, const ChainRule& rule, double within, std::span<const double> reach,
                            std::vector<SegmentPair>& pairs) {
    pairs.clear();
    runs_.clear();
    if (axis.size() < 2) return;
    axis_ = axis, pairs_ = &pairs, least_gap_ = rule.least_gap(), reach_ = reach, within_ = within;
    (void)build(0, static_cast<Index>(axis.size() - 1));
    meet_itself(0);
    std::sort(pairs.begin(), pairs.end(), [](const SegmentPair& x, const SegmentPair& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
}

Index ChainBoxes::build(Index begin, Index end) {
    const auto run = static_cast<Index>(runs_.size());
    runs_.push_back({begin, end, 0, 0, Box3()});
    Box3 box;
    if (end - begin > kLeafSegments) {
        const Index middle = begin + (end - begin) / 2;
        const Index left = build(begin, middle), right = build(middle, end);
        runs_[run].left = left, runs_[run].right = right;
        box = runs_[left].box;
        box.add(runs_[right].box);
    } else {
        double farthest = 0.0;
        for (Index node = begin; node <= end; ++node) box.add(axis_[node]), farthest = std::max(farthest, reach_[node]);
        box.inflate(farthest);
    }
    runs_[run].box = box;
    return run;
}

void ChainBoxes::meet_itself(Index run) {
    const Run& r = runs_[run];
    if (r.end - r.begin <= least_gap_) return; // none of them is a pair
    if (r.left == 0) {
        for (Index a = r.begin; a < r.end; ++a)
            for (Index b = a + least_gap_; b < r.end; ++b) test(a, b);
        return;
    }
    meet_itself(r.left), meet_itself(r.right), meet(r.left, r.right);
}

/// Of runs of which a comes before b.
void ChainBoxes::meet(Index a, Index b) {
    const Run &one = runs_[a], &two = runs_[b];
    if (two.end - 1 - one.begin < least_gap_) return;
    if (!(distance_sq(one.box, two.box) < within_ * within_)) return;
    if (one.left == 0 && two.left == 0) {
        for (Index i = one.begin; i < one.end; ++i)
            for (Index j = std::max(two.begin, i + least_gap_); j < two.end; ++j) test(i, j);
        return;
    }
    if (two.left == 0 || (one.left != 0 && one.end - one.begin >= two.end - two.begin))
        meet(one.left, b), meet(one.right, b);
    else
        meet(a, two.left), meet(a, two.right);
}

void ChainBoxes::test(Index a, Index b) {
    const SegmentPair pair = nearest_on_pair(a, b, {axis_[a], axis_[a + 1], axis_[b], axis_[b + 1]});
    if (pair.distance < within_ + std::max(reach_[a], reach_[a + 1]) + std::max(reach_[b], reach_[b + 1])) pairs_->push_back(pair);
}

void ChainBoxes::bound(std::span<const Vec3> axis, std::span<const double> reach, Index begin) {
    runs_.clear();
    axis_ = axis, reach_ = reach;
    if (begin + 1 < axis.size()) (void)build(begin, static_cast<Index>(axis.size() - 1));
}

void ChainBoxes::find_pairs_with(const ChainBoxes& other, double within, std::vector<SegmentPair>& pairs) const {
    if (runs_.empty() || other.runs_.empty()) return;
    const auto known = static_cast<std::ptrdiff_t>(pairs.size());
    meet_other(0, other, 0, within, pairs);
    std::sort(pairs.begin() + known, pairs.end(), [](const SegmentPair& x, const SegmentPair& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
}

void ChainBoxes::meet_other(Index run, const ChainBoxes& other, Index its, double within, std::vector<SegmentPair>& pairs) const {
    const Run &one = runs_[run], &two = other.runs_[its];
    if (!(distance_sq(one.box, two.box) < within * within)) return;
    if (one.left != 0 && (two.left == 0 || one.end - one.begin >= two.end - two.begin))
        return meet_other(one.left, other, its, within, pairs), meet_other(one.right, other, its, within, pairs);
    if (two.left != 0) return meet_other(run, other, two.left, within, pairs), meet_other(run, other, two.right, within, pairs);
    for (Index a = one.begin; a < one.end; ++a)
        for (Index b = two.begin; b < two.end; ++b) {
            const SegmentPair pair = nearest_on_pair(a, b, {axis_[a], axis_[a + 1], other.axis_[b], other.axis_[b + 1]});
            const double reach = std::max(reach_[a], reach_[a + 1]) + std::max(other.reach_[b], other.reach_[b + 1]);
            if (pair.distance < within + reach) pairs.push_back(pair);
        }
}

} // namespace trocar::fem
