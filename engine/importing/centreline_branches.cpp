#include "engine/importing/centreline_branches.hpp"

#include "base/inside.hpp"
#include "base/trig.hpp"
#include "spheretree/lumen/centreline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace trocar::engine {

namespace {

/// Of the median inscribed sphere: distance of the points along a branch, within these bounds.
constexpr double kSpacingShare = 0.5, kLeastSpacing = 1e-4, kLargestSpacing = 2e-3; // [-], m, m
/// Points along the longest side of the surface's box, at most.
constexpr double kMostAlong = 800.0;
/// Centring: halvings of the step, which begins at this share of the radius, moves with each, directions tried for a move.
constexpr int kHalvings = 6, kMovesEach = 4, kDirections = 12;
constexpr double kFirstStep = 0.25;
/// An end branch that is shorter than this many radii of the fork it leaves, or that has fewer than so many of its own beyond the fork's
/// sphere, is a dent or a ridge of the wall, not a vessel; unless it comes to an opening, within so many of that one's radii.
constexpr double kShortBranch = 2.0, kLeastOutside = 3.0, kAtOpening = 2.0;
/// Of a branch's median radius: wider points within so many radii of its fork lie in the vessel that it leaves.
constexpr double kParentWidth = 1.25, kForkReach = 3.0;
/// Of an end branch's median radius: narrower points at its tip run into a corner.
constexpr double kCorner = 0.5;

using spheretree::CentrelineTree;

double median_radius(const spheretree::LumenTree& lumen) {
    std::vector<double> radii;
    for (Index ball = 0; ball < lumen.ball_count(); ++ball) radii.push_back(lumen.ball(ball).radius);
    std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2), radii.end());
    return radii[radii.size() / 2];
}

/// Two directions across an axis.
std::array<Vec3, 2> directions_across(const Vec3& axis) {
    int least = 0;
    axis.cwiseAbs().minCoeff(&least);
    const Vec3 first = axis.cross(Vec3::Unit(least)).normalized();
    return {first, axis.cross(first)};
}

/// m. Steps are shorter than the distance to the wall: a point that is inside stays so.
/// Moves a point across the axis to where the wall is farthest; returns its distance to the wall there.
double centre_point(const InsideTest& inside, const Vec3& axis, Vec3& p) {
    double best = -inside.signed_distance(p);
    if (!(best > 0.0) || !(axis.norm() > 0.0)) return best;
    const auto [across, other] = directions_across(axis.normalized());
    double step = kFirstStep * best;
    for (int halving = 0; halving < kHalvings; ++halving, step *= 0.5)
        for (int move = 0; move < kMovesEach; ++move) {
            Vec3 better = p;
            for (int k = 0; k < kDirections; ++k) { // turned by half their angle with each halving: the nearest walls meet in ridges
                const auto [s, c] = sin_cos((k + 0.5 * (halving % 2)) * 2.0 * std::numbers::pi / kDirections);
                const Vec3 tried = p + step * (c * across + s * other);
                const auto wall = inside.tree().closest(tried, 1.001 * (best + step)); // it cannot be farther
                if (wall && wall->distance > best) best = wall->distance, better = tried;
            }
            if (better == p) break;
            p = better;
        }
    return best;
}

std::vector<std::vector<Index>> children_of(const CentrelineTree& tree) {
    std::vector<std::vector<Index>> children(tree.point_count());
    for (Index i = 1; i < tree.point_count(); ++i) children[tree.parents[i]].push_back(i);
    return children;
}

/// The end branch of a tree: from a tip back to the fork that it leaves.
struct EndBranch {
    Index tip, fork;
    double length = 0.0;  // m, from the fork
    double outside = 0.0; // m, of it beyond the inscribed sphere at the fork
    double radius = 0.0;  // m, median
};

EndBranch measure_end(const CentrelineTree& tree, const std::vector<std::vector<Index>>& children, Index tip) {
    EndBranch end{tip, tip};
    std::vector<double> radii{tree.radii[tip]};
    Index at = tip;
    do {
        const Index before = tree.parents[at];
        end.length += (tree.points[at] - tree.points[before]).norm();
        at = before;
        if (children[at].size() == 1) radii.push_back(tree.radii[at]);
    } while (at != 0 && children[at].size() == 1);
    end.fork = at;
    std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2), radii.end());
    end.radius = radii[radii.size() / 2];
    for (Index p = tip; p != end.fork; p = tree.parents[p])
        if ((tree.points[p] - tree.points[end.fork]).norm() > tree.radii[end.fork])
            end.outside += (tree.points[p] - tree.points[tree.parents[p]]).norm();
    return end;
}

/// How much of a vessel it is: below 1 a dent, a ridge or a corner.
double vessel_share(const CentrelineTree& tree, const EndBranch& end) {
    return std::min(end.length / (kShortBranch * std::max(tree.radii[end.fork], 1e-12)), end.outside / (kLeastOutside * std::max(end.radius, 1e-12)));
}

bool comes_to(std::span<const VesselEnd> openings, const Vec3& tip) {
    return std::any_of(openings.begin(), openings.end(), [&](const VesselEnd& end) { return (end.centre - tip).norm() < kAtOpening * end.radius; });
}

/// [point] there is still a way to it from the root.
std::vector<bool> find_kept(const std::vector<std::vector<Index>>& children) {
    std::vector<bool> kept(children.size(), false);
    kept[0] = true;
    for (Index p = 0; p < children.size(); ++p) // parents come first
        if (kept[p])
            for (const Index child : children[p]) kept[child] = true;
    return kept;
}

/// Takes out end branches that are no vessels, the least of one first: a fork that it leaves becomes a place on the way.
void prune_ends(const CentrelineTree& tree, std::vector<std::vector<Index>>& children, std::span<const VesselEnd> openings) {
    for (;;) {
        std::optional<EndBranch> worst;
        double least = 1.0;
        std::size_t ends = 0;
        const std::vector<bool> kept = find_kept(children);
        for (Index tip = 1; tip < tree.point_count(); ++tip) {
            if (!kept[tip] || !children[tip].empty()) continue;
            ++ends;
            const EndBranch end = measure_end(tree, children, tip);
            if (const double share = vessel_share(tree, end); share < least && !comes_to(openings, tree.points[tip])) least = share, worst = end;
        }
        if (!worst || ends < 2) return;
        Index first = worst->tip;
        while (tree.parents[first] != worst->fork) first = tree.parents[first];
        std::erase(children[worst->fork], first);
    }
}

/// The last points of an end branch that run into a corner of its cap.
void trim_tips(const CentrelineTree& tree, std::vector<std::vector<Index>>& children) {
    const std::vector<bool> kept = find_kept(children);
    for (Index tip = 1; tip < tree.point_count(); ++tip) {
        if (!kept[tip] || !children[tip].empty()) continue;
        const EndBranch end = measure_end(tree, children, tip);
        for (Index at = tip; tree.radii[at] < kCorner * end.radius && tree.parents[at] != end.fork && tree.parents[at] != 0;) {
            at = tree.parents[at];
            children[at].clear();
        }
    }
}

/// Behind a fork the middle of a branch still lies in that of the wider vessel which it leaves: from the fork straight to where it is as wide as
/// itself.
void leave_parent(CentrelineBranch& branch) {
    std::vector<double> sorted = branch.radii;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    const double own = sorted[sorted.size() / 2], reach = kForkReach * branch.radii[0];
    std::size_t first = 1;
    while (first + 2 < branch.points.size() && branch.radii[first] > kParentWidth * own && (branch.points[first] - branch.points[0]).norm() < reach) ++first;
    branch.points.erase(branch.points.begin() + 1, branch.points.begin() + static_cast<std::ptrdiff_t>(first));
    branch.radii.erase(branch.radii.begin() + 1, branch.radii.begin() + static_cast<std::ptrdiff_t>(first));
}

std::vector<CentrelineBranch> split_at_forks(const CentrelineTree& tree, std::span<const VesselEnd> openings) {
    std::vector<std::vector<Index>> children = children_of(tree);
    prune_ends(tree, children, openings);
    trim_tips(tree, children);
    struct Start {
        Index fork, first, parent;
    };
    std::vector<CentrelineBranch> branches;
    std::vector<Start> waiting;
    for (const Index child : children[0]) waiting.push_back({0, child, kNoIndex});
    for (std::size_t next = 0; next < waiting.size(); ++next) {
        const Start start = waiting[next];
        CentrelineBranch branch{{tree.points[start.fork]}, {tree.radii[start.fork]}, start.parent, true};
        Index at = start.first;
        for (;;) {
            branch.points.push_back(tree.points[at]);
            branch.radii.push_back(tree.radii[at]);
            if (children[at].size() != 1) break;
            at = children[at].front();
        }
        branch.ends = children[at].empty();
        for (const Index child : children[at]) waiting.push_back({at, child, static_cast<Index>(branches.size())});
        if (start.parent != kNoIndex) leave_parent(branch);
        branches.push_back(std::move(branch));
    }
    return branches;
}

/// Centres all points but the root and the tips, which stay where the lumen tree has them. Then radii by the wall.
void centre_tree(const InsideTest& inside, CentrelineTree& tree) {
    const std::vector<std::vector<Index>> children = children_of(tree);
    const std::vector<Vec3> old = tree.points;
    for (Index i = 0; i < tree.point_count(); ++i) {
        const bool plain = i > 0 && !children[i].empty();
        if (plain)
            tree.radii[i] = centre_point(inside, old[children[i].front()] - old[tree.parents[i]], tree.points[i]);
        else
            tree.radii[i] = -inside.signed_distance(tree.points[i]);
    }
}

} // namespace

Result<std::vector<CentrelineBranch>> find_branches(const TriMesh& closed, const spheretree::LumenTree& lumen, const Vec3& root,
                                                    std::span<const VesselEnd> openings, Centring centring) {
    spheretree::CentrelineOptions options;
    const double least = std::max(kLeastSpacing, closed.bounds().longest_edge() / kMostAlong);
    options.spacing = std::clamp(kSpacingShare * median_radius(lumen), least, std::max(least, kLargestSpacing));
    Result<CentrelineTree> tree = spheretree::find_centreline_tree(lumen, root, options);
    if (!tree.ok()) return tree.error();
    if (centring == Centring::Full) centre_tree(InsideTest(closed), *tree);
    return split_at_forks(*tree, openings);
}

CentrelineWay way_to(std::span<const CentrelineBranch> branches, Index branch) {
    std::vector<Index> chain;
    for (Index b = branch; b != kNoIndex; b = branches[b].parent) chain.push_back(b);
    CentrelineWay way;
    for (auto b = chain.rbegin(); b != chain.rend(); ++b) {
        const std::size_t from = way.points.empty() ? 0 : 1; // a branch begins with its parent's last point
        way.points.insert(way.points.end(), branches[*b].points.begin() + static_cast<std::ptrdiff_t>(from), branches[*b].points.end());
        way.radii.insert(way.radii.end(), branches[*b].radii.begin() + static_cast<std::ptrdiff_t>(from), branches[*b].radii.end());
    }
    for (std::size_t i = 1; i < way.points.size(); ++i) way.length += (way.points[i] - way.points[i - 1]).norm();
    return way;
}

} // namespace trocar::engine
