#include "assets/anatomy/hepatic_tree.hpp"

#include "base/closest_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar::anatomy {
namespace {

constexpr double kLeastLeg = 0.009;     // m, shorter legs cannot be turned into gentle curves
constexpr double kLeastEndLeg = 0.016;  // m
constexpr double kLeastGap = 0.004;     // m, wall to wall between vessels that do not touch, before they are smoothed
constexpr double kMajorBend = 0.75;     // rad, most a vessel turns where another leaves it
constexpr double kMinorBend = 1.15;     // rad, most a leaving vessel turns away
constexpr double kCurveMargin = 0.0015;   // m, curves may leave their straight segments by this much towards the capsule
constexpr int kCandidates = 120;        // places drawn for every new end
constexpr int kTries = 60;              // of those, the ones farthest from the tree that are tried
constexpr std::uint32_t kLeftEvery = 3; // every so many ends one is the left lobe's: its share of the tissue
constexpr int kSplits = 9;              // fork points tried along each side of the triangle they span

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

class Grower {
public:
    Grower(const Recipe& recipe, const LiverShape& liver, const Vec3& approach, Random& random)
        : recipe_(recipe), liver_(liver), approach_(approach), random_(random) {}

    std::optional<HepaticTree> run() {
        lay_main_stems();
        if (!join(inner_place({60, 26, 14}, 5, 0.015), recipe_.tumour_flow)) return std::nullopt;
        tree_.tumour = static_cast<Index>(tree_.segments.size() - 1);
        for (std::uint32_t ends = 3; ends < recipe_.terminals; ++ends)
            if (!(ends % kLeftEvery == 0 && add_end(true)) && !add_end(false)) return std::nullopt;
        return std::move(tree_);
    }

private:
    struct Join {
        Index segment = kNoIndex;
        Vec3 fork = Vec3::Zero();
        double cost = std::numeric_limits<double>::infinity();
    };

    const Recipe& recipe_;
    const LiverShape& liver_;
    Vec3 approach_;
    Random& random_;
    HepaticTree tree_;

    [[nodiscard]] double radius(double flow) const { return murray_radius(recipe_, flow); }

    [[nodiscard]] Vec3 arrival(const TreeSegment& s) const { // flow direction into s
        if (s.parent == kNoIndex) return approach_;
        return tree_.segments[s.parent].to - tree_.segments[s.parent].from;
    }

    /// A place near the atlas's, moved inwards until `depth` of tissue is around it (or the liver is not that thick).
    [[nodiscard]] Vec3 inner_place(const Vec3& atlas_mm, double freedom_mm, double depth) const {
        Vec3 p = liver_.place(atlas_mm + freedom_mm * recipe_.variation * random_.cube());
        for (int step = 0; step < 60 && liver_.distance(p) > -depth; ++step) p -= 0.001 * liver_.gradient(p).normalized();
        return p;
    }

    /// Right and left hepatic artery to just inside the liver, and one long vessel in each lobe.
    void lay_main_stems() {
        const Vec3 hilum = liver_.place(Vec3::Zero());
        const Vec3 right = inner_place({21, -2, 7}, 2, 0.011), left = inner_place({-16, 14, 20}, 2, 0.010);
        const Vec3 right_end = inner_place({74, -28, -8}, 4, 0.012), left_end = inner_place({-68, 30, 34}, 4, 0.011);
        tree_.segments = {{hilum, right, kNoIndex, 2, kNoIndex, 1.0, false},
                          {hilum, left, kNoIndex, 3, kNoIndex, 1.0, false},
                          {right, right_end, 0, kNoIndex, kNoIndex, 1.0, true},
                          {left, left_end, 1, kNoIndex, kNoIndex, 1.0, true}};
    }

    /// Of some random places, the ones farthest from the tree first.
    /// in_left_lobe  only places left of the umbilical fissure
    bool add_end(bool in_left_lobe) {
        std::vector<std::pair<double, Vec3>> places;
        const Box3 box = liver_.box();
        const double depth = recipe_.capsule_margin + recipe_.terminal_radius + kCurveMargin + 0.003;
        const double left_of = liver_.place(Vec3(-24, 0, 0))[0];
        while (places.size() < kCandidates) {
            const Vec3 p = box.lo + (0.5 * (random_.cube() + Vec3::Ones())).cwiseProduct(box.extent());
            if ((in_left_lobe && p[0] > left_of) || liver_.distance(p) > -depth) continue;
            places.emplace_back(-distance_to_tree(p), p);
        }
        std::stable_sort(places.begin(), places.end(), [](const auto& l, const auto& r) { return l.first < r.first; });
        for (int i = 0; i < kTries; ++i)
            if (join(places[static_cast<std::size_t>(i)].second, 1.0)) return true;
        return false;
    }

    [[nodiscard]] double distance_to_tree(const Vec3& p) const {
        double least = std::numeric_limits<double>::infinity();
        for (const TreeSegment& s : tree_.segments) least = std::min(least, closest_on_segment(p, {s.from, s.to}).distance_sq);
        return std::sqrt(least);
    }

    bool join(const Vec3& end, double flow) {
        Join best;
        for (Index i = 0; i < tree_.segments.size(); ++i)
            if (tree_.segments[i].forkable) find_fork(i, end, flow, best);
        if (best.segment == kNoIndex) return false;
        split(best, end, flow);
        return true;
    }

    /// Fork points in the triangle of the segment's ends and the new end.
    void find_fork(Index i, const Vec3& end, double flow, Join& best) const {
        const TreeSegment& s = tree_.segments[i];
        const double upstream = upstream_cost(i, flow);
        for (int along = 1; along < kSplits; ++along)
            for (int off = 0; off < kSplits / 2; ++off) {
                const double u = static_cast<double>(along) / kSplits, v = static_cast<double>(off) / kSplits;
                const Vec3 on_segment = s.from + u * (s.to - s.from);
                const Vec3 fork = on_segment + v * (end - on_segment);
                const double cost = upstream + fork_cost(s, fork, end, flow);
                if (cost < best.cost && allowed(i, fork, end, flow)) best = {i, fork, cost};
            }
    }

    [[nodiscard]] double volume(const Vec3& from, const Vec3& to, double flow) const {
        return (to - from).norm() * radius(flow) * radius(flow);
    }
    [[nodiscard]] double upstream_cost(Index i, double flow) const {
        double cost = 0.0;
        for (Index p = tree_.segments[i].parent; p != kNoIndex; p = tree_.segments[p].parent) {
            const TreeSegment& s = tree_.segments[p];
            cost += volume(s.from, s.to, s.flow + flow) - volume(s.from, s.to, s.flow);
        }
        return cost;
    }
    /// Blood volume (over pi) that the fork adds, and a price on bends: a catheter has to follow.
    [[nodiscard]] double fork_cost(const TreeSegment& s, const Vec3& fork, const Vec3& end, double flow) const {
        const Vec3 in = fork - s.from;
        const double major = angle_between(in, s.to - fork), minor = angle_between(in, end - fork);
        const double r = radius(s.flow + flow);
        return volume(s.from, fork, s.flow + flow) + volume(fork, s.to, s.flow) + volume(fork, end, flow) - volume(s.from, s.to, s.flow) +
               0.006 * r * r * (major * major + 0.5 * minor * minor);
    }

    [[nodiscard]] bool allowed(Index i, const Vec3& fork, const Vec3& end, double flow) const {
        const TreeSegment& s = tree_.segments[i];
        const Vec3 in = fork - s.from, on = s.to - fork, off = end - fork;
        if (in.norm() < kLeastLeg || off.norm() < kLeastEndLeg) return false;
        if (on.norm() < (s.major == kNoIndex ? kLeastEndLeg : kLeastLeg)) return false;
        const double on_bend = angle_between(in, on), off_bend = angle_between(in, off);
        if (std::min(on_bend, off_bend) > kMajorBend || std::max(on_bend, off_bend) > kMinorBend) return false;
        if (angle_between(on, off) < 0.6) return false;
        // Neighbouring forks: not beyond the bound, or not beyond what they were.
        const Vec3 old = s.to - s.from;
        const bool leaves = s.parent != kNoIndex && tree_.segments[s.parent].minor == i;
        const double old_turn = angle_between(arrival(s), old);
        if (angle_between(arrival(s), in) > std::max(old_turn, leaves ? kMinorBend : kMajorBend)) return false;
        for (const Index child : {s.major, s.minor}) {
            if (child == kNoIndex) continue;
            const Vec3 next = tree_.segments[child].to - tree_.segments[child].from;
            const double limit = child == s.major ? kMajorBend : kMinorBend;
            if (angle_between(on, next) > std::max(angle_between(old, next), limit)) return false;
        }
        return inside(s.from, fork, s.flow + flow, s.parent) && inside(fork, s.to, s.flow, i) && inside(fork, end, flow, i) &&
               clear(i, s.from, fork, s.flow + flow) && clear(i, fork, s.to, s.flow) && clear(i, fork, end, flow);
    }

    [[nodiscard]] bool inside(const Vec3& from, const Vec3& to, double flow, Index parent) const {
        const double depth = recipe_.capsule_margin + radius(flow) + kCurveMargin;
        const int pieces = static_cast<int>((to - from).norm() / 0.004) + 1;
        // The stems enter the liver: their first stretch is only as deep as they have come.
        const int first = parent != kNoIndex && !tree_.segments[parent].forkable ? 1 : 0;
        for (int k = first; k <= pieces; ++k)
            if (liver_.distance(from + (to - from) * k / pieces) > -depth) return false;
        return true;
    }

    /// Keeps away from every vessel but the ones it shares a fork with (and segment i, which it replaces).
    [[nodiscard]] bool clear(Index i, const Vec3& from, const Vec3& to, double flow) const {
        for (Index k = 0; k < tree_.segments.size(); ++k) {
            const TreeSegment& s = tree_.segments[k];
            if (k == i || s.from == from || s.to == from || s.from == to || s.to == to) continue;
            const double apart = std::sqrt(closest_on_segments({s.from, s.to}, {from, to}).distance_sq);
            if (apart - radius(s.flow) - radius(flow) < kLeastGap) return false;
        }
        return true;
    }

    void split(const Join& join, const Vec3& end, double flow) {
        const auto on = static_cast<Index>(tree_.segments.size());
        const Index off = on + 1;
        TreeSegment s = tree_.segments[join.segment];
        TreeSegment far = s;
        far.from = join.fork;
        far.parent = join.segment;
        for (const Index child : {far.major, far.minor})
            if (child != kNoIndex) tree_.segments[child].parent = on;
        s.to = join.fork;
        const Vec3 in = s.to - s.from;
        const bool goes_on = angle_between(in, far.to - far.from) <= angle_between(in, end - join.fork);
        s.major = goes_on ? on : off;
        s.minor = goes_on ? off : on;
        tree_.segments[join.segment] = s;
        tree_.segments.push_back(far);
        tree_.segments.push_back({join.fork, end, join.segment, kNoIndex, kNoIndex, flow, true});
        if (tree_.tumour == join.segment) tree_.tumour = on;
        for (Index p = join.segment; p != kNoIndex; p = tree_.segments[p].parent) tree_.segments[p].flow += flow;
    }
};

} // namespace

double murray_radius(const Recipe& recipe, double flow) { return recipe.terminal_radius * std::pow(flow, 1 / recipe.murray_exponent); }

std::optional<HepaticTree> grow_hepatic_tree(const Recipe& recipe, const LiverShape& liver, const Vec3& approach, Random& random) {
    return Grower(recipe, liver, approach, random).run();
}

} // namespace trocar::anatomy
