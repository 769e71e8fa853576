// A box tree that follows a surface that changes little, instead of being fitted to it in every step.
#include "base/triangle_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar {
namespace {

/// Share of that at which renewal begins.
constexpr double kRenewFrom = 0.25;
/// Of the nodes, in a call at most motionless: a renewal that was begun ends.
constexpr double kLeastShare = 1.0 / 32.0;
/// Of the largest coordinate: more than the rounding of a difference and of a sum.
constexpr double kWayRounding = 0x1p-50;

/// m; half of how far the ways of vertices differ along an axis: what they have in common opens no box. Infinite for an infinite box.
double opening_of(const Box3& ways) noexcept {
    const double widest = ways.extent().maxCoeff();
    return widest >= 0.0 ? 0.5 * widest : std::numeric_limits<double>::infinity();
}

} // namespace

void TriangleTree::start_following(std::span<const Vec3> vertices, double loosest) {
    refit(vertices);
    fitted_.assign(vertices.begin(), vertices.end());
    renewing_ = fitted_;
    renewed_ = nodes_;
    double extents = 0.0;
    for (Index slot = 0; slot < order_.size(); ++slot) extents += triangle_box(slot).extent().maxCoeff();
    loosest_ = order_.empty() || !std::isfinite(extents) ? 0.0 : loosest * extents / static_cast<double>(order_.size());
}

void TriangleTree::fit_nodes(std::span<Node> nodes, std::size_t from, std::size_t to, std::span<const Triangle> triangles,
                             std::span<const Vec3> vertices) noexcept {
    fit_boxes(nodes, from, to, [&](Index slot) {
        const Triangle& t = triangles[slot];
        return std::array{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
    });
}

/// ways_ and bounds_, of now_ against fitted_. Where a vertex is not finite the ways are infinite.
void TriangleTree::find_ways() noexcept {
    constexpr std::size_t kLanes = 12; // coordinates of four vertices at a time, which compilers turn into vectors
    std::array<double, kLanes> least, most, low, high, bad{};
    least.fill(std::numeric_limits<double>::infinity());
    low = least;
    most.fill(-std::numeric_limits<double>::infinity());
    high = most;
    const auto look_at = [&](const double* from, const double* to, std::size_t count) __attribute__((always_inline)) {
        for (std::size_t k = 0; k < count; ++k) {
            const double way = to[k] - from[k];
            bad[k] += 0.0 * way; // NaN from then on, of what is not finite
            least[k] = way < least[k] ? way : least[k];
            most[k] = way > most[k] ? way : most[k];
            low[k] = to[k] < low[k] ? to[k] : low[k];
            high[k] = to[k] > high[k] ? to[k] : high[k];
        }
    };
    const std::size_t count = 3 * now_.size();
    if (count == 0) return;
    const double *from = fitted_.front().data(), *to = now_.front().data();
    std::size_t at = 0;
    for (; at + kLanes <= count; at += kLanes) look_at(from + at, to + at, kLanes);
    look_at(from + at, to + at, count - at);
    ways_ = bounds_ = Box3{};
    double largest = 0.0;
    bool finite = true;
    for (std::size_t k = 0; k < kLanes; ++k) {
        const auto axis = static_cast<int>(k % 3);
        finite = finite && bad[k] == 0.0;
        ways_.lo[axis] = std::min(ways_.lo[axis], least[k]);
        ways_.hi[axis] = std::max(ways_.hi[axis], most[k]);
        bounds_.lo[axis] = std::min(bounds_.lo[axis], low[k]);
        bounds_.hi[axis] = std::max(bounds_.hi[axis], high[k]);
    }
    for (int axis = 0; axis < 3; ++axis)
        largest = std::max({largest, std::abs(bounds_.lo[axis]), std::abs(bounds_.hi[axis]), std::abs(ways_.lo[axis]), std::abs(ways_.hi[axis])});
    ways_.inflate(finite ? kWayRounding * largest : std::numeric_limits<double>::infinity());
}

void TriangleTree::renew_part(double share) noexcept {
    const auto part = static_cast<std::size_t>(share * static_cast<double>(renewed_.size())) + 1;
    const std::size_t from = left_ > part ? left_ - part : 0;
    fit_nodes(renewed_, from, left_, triangles_, renewing_);
    left_ = from;
    if (left_ > 0) return;
    std::swap(nodes_, renewed_);
    std::swap(fitted_, renewing_);
    find_ways();
}

void TriangleTree::follow(std::span<const Vec3> vertices) noexcept {
    if (vertices.size() != fitted_.size()) return refit(vertices); // start_following() was not called
    now_ = vertices;
    const double before = opening_of(ways_);
    find_ways();
    const double opening = opening_of(ways_);
    if (!(opening <= loosest_)) { // also where a vertex is not finite: boxes without it, as refit makes them
        std::copy(vertices.begin(), vertices.end(), fitted_.begin());
        fit_nodes(nodes_, 0, nodes_.size(), triangles_, fitted_);
        ways_ = {Vec3::Zero(), Vec3::Zero()};
        left_ = 0;
    } else if (left_ > 0) {
        renew_part(std::max(kLeastShare, (opening - before) / ((1.0 - kRenewFrom) * loosest_)));
    } else if (opening > kRenewFrom * loosest_) {
        std::copy(vertices.begin(), vertices.end(), renewing_.begin());
        left_ = renewed_.size();
    }
}

} // namespace trocar
