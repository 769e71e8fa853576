// A box tree that follows a slowly moving surface instead of being fitted to it in every step.
#include "base/triangle_tree.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

/// Of the mean extent of a triangle. Boxes that are open by this much still leave out most of what they should; beyond it, queries that
/// enter twice as many leaves cost more than fitting everything.
constexpr double kLoosest = 1.0;
/// Share of that at which renewal begins.
constexpr double kRenewFrom = 0.25;
/// Of the nodes, in a call at most motionless: a renewal that was begun ends.
constexpr double kLeastShare = 1.0 / 32.0;

/// m per axis. Infinite where a vertex is not finite.
Vec3 longest_ways(std::span<const Vec3> from, std::span<const Vec3> to) noexcept {
    Vec3 longest = Vec3::Zero();
    for (std::size_t v = 0; v < from.size(); ++v) {
        const Vec3 way = (to[v] - from[v]).cwiseAbs();
        for (int k = 0; k < 3; ++k)
            if (!(way[k] <= longest[k])) longest[k] = way[k] > longest[k] ? way[k] : std::numeric_limits<double>::infinity();
    }
    return longest * (1.0 + 0x1p-40); // no less than the true one
}

} // namespace

void TriangleTree::start_following(std::span<const Vec3> vertices) {
    refit(vertices);
    fitted_.assign(vertices.begin(), vertices.end());
    renewing_ = fitted_;
    renewed_ = nodes_;
    double extents = 0.0;
    for (Index slot = 0; slot < order_.size(); ++slot) extents += triangle_box(slot).extent().maxCoeff();
    loosest_ = order_.empty() || !std::isfinite(extents) ? 0.0 : kLoosest * extents / static_cast<double>(order_.size());
}

void TriangleTree::fit_nodes(std::span<Node> nodes, std::size_t from, std::size_t to, std::span<const Triangle> triangles,
                             std::span<const Vec3> vertices) noexcept {
    fit_boxes(nodes, from, to, [&](Index slot) {
        const Triangle& t = triangles[slot];
        return std::array{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
    });
}

void TriangleTree::renew_part(double share) noexcept {
    const auto part = static_cast<std::size_t>(share * static_cast<double>(renewed_.size())) + 1;
    const std::size_t from = left_ > part ? left_ - part : 0;
    fit_nodes(renewed_, from, left_, triangles_, renewing_);
    left_ = from;
    if (left_ > 0) return;
    std::swap(nodes_, renewed_);
    std::swap(fitted_, renewing_);
    slack_ = longest_ways(fitted_, now_);
}

void TriangleTree::follow(std::span<const Vec3> vertices) noexcept {
    if (vertices.size() != fitted_.size()) return refit(vertices); // start_following() was not called
    now_ = vertices;
    const double before = slack_.maxCoeff();
    slack_ = longest_ways(fitted_, vertices);
    const double slack = slack_.maxCoeff();
    if (!(slack <= loosest_)) { // also where a vertex is not finite: boxes without it, as refit makes them
        std::copy(vertices.begin(), vertices.end(), fitted_.begin());
        fit_nodes(nodes_, 0, nodes_.size(), triangles_, fitted_);
        slack_.setZero();
        left_ = 0;
    } else if (left_ > 0) {
        renew_part(std::max(kLeastShare, (slack - before) / ((1.0 - kRenewFrom) * loosest_)));
    } else if (slack > kRenewFrom * loosest_) {
        std::copy(vertices.begin(), vertices.end(), renewing_.begin());
        left_ = renewed_.size();
    }
}

} // namespace trocar
