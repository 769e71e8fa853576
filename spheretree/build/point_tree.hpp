// Static kd-tree over points, for range queries of any radius. Offline.
#pragma once

#include "base/box.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

namespace trocar::spheretree {

class PointTree {
public:
    /// points  finite
    explicit PointTree(std::span<const Vec3> points) : order_(points.size()) {
        std::iota(order_.begin(), order_.end(), Index{0});
        if (!points.empty()) build(points, 0, static_cast<Index>(points.size()));
        points_.reserve(points.size());
        for (const Index id : order_) points_.push_back(points[id]);
    }

    /// Calls visit(point id, squared distance) for every point within `radius` of p, in a fixed order.
    template <class Visit>
    void for_each_within(const Vec3& p, double radius, Visit&& visit) const {
        if (!nodes_.empty()) descend(0, p, radius * radius, visit);
    }

    /// The largest value beneath each node, for for_each_below. values [points] by point id      most [node_count] out
    void find_most(std::span<const double> values, std::vector<double>& most) const {
        most.resize(nodes_.size());
        for (std::size_t n = nodes_.size(); n-- > 0;) { // children follow their parents
            double largest = -std::numeric_limits<double>::infinity();
            if (nodes_[n].right != kNoIndex)
                largest = std::max(most[n + 1], most[nodes_[n].right]);
            else
                for (Index i = nodes_[n].begin; i < nodes_[n].end; ++i) largest = std::max(largest, values[order_[i]]);
            most[n] = largest;
        }
    }

    /// Calls visit(point id, squared distance) for every point whose distance from p is at most `reach` plus its value, and for some
    /// others, in the order of for_each_within. most: of find_most; values may have become smaller since.
    template <class Visit>
    void for_each_below(const Vec3& p, double reach, std::span<const double> most, Visit&& visit) const {
        if (!nodes_.empty()) descend_below(0, p, reach, most, visit);
    }

    /// Nearest point within max_distance of p; of equally near ones the first met. kNoIndex: none.
    [[nodiscard]] Index nearest(const Vec3& p, double max_distance, double& distance) const noexcept {
        Index best = kNoIndex;
        double best_sq = max_distance * max_distance;
        if (!nodes_.empty()) search(0, p, best_sq, best);
        distance = std::sqrt(best_sq);
        return best;
    }

private:
    struct Node {
        Box3 box;
        Index begin = 0, end = 0;
        Index right = kNoIndex; // kNoIndex: leaf; the left child follows its parent
    };
    static constexpr Index kLeafPoints = 16; // a box test costs about as much as a few points

    Index build(std::span<const Vec3> points, Index begin, Index end) {
        const auto id = static_cast<Index>(nodes_.size());
        nodes_.push_back({{}, begin, end, kNoIndex});
        Box3 box;
        for (Index i = begin; i < end; ++i) box.add(points[order_[i]]);
        nodes_[id].box = box;
        if (end - begin <= kLeafPoints) return id;
        int axis = 0;
        box.extent().maxCoeff(&axis);
        const Index middle = begin + (end - begin) / 2;
        std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                         [&](Index a, Index b) { return points[a][axis] != points[b][axis] ? points[a][axis] < points[b][axis] : a < b; });
        build(points, begin, middle);
        const Index right = build(points, middle, end);
        nodes_[id].right = right;
        return id;
    }

    static double box_distance_sq(const Box3& box, const Vec3& p) noexcept {
        return (p.cwiseMax(box.lo).cwiseMin(box.hi) - p).squaredNorm();
    }

    void search(Index id, const Vec3& p, double& best_sq, Index& best) const noexcept {
        const Node& node = nodes_[id];
        if (node.right == kNoIndex) {
            for (Index i = node.begin; i < node.end; ++i)
                if (const double d = (points_[i] - p).squaredNorm(); d < best_sq) {
                    best_sq = d;
                    best = order_[i];
                }
            return;
        }
        const double left = box_distance_sq(nodes_[id + 1].box, p), right = box_distance_sq(nodes_[node.right].box, p);
        const bool left_first = left <= right;
        if ((left_first ? left : right) < best_sq) search(left_first ? id + 1 : node.right, p, best_sq, best);
        if ((left_first ? right : left) < best_sq) search(left_first ? node.right : id + 1, p, best_sq, best);
    }

    template <class Visit>
    void descend(Index id, const Vec3& p, double radius_sq, Visit& visit) const {
        const Node& node = nodes_[id];
        const Vec3 nearest = p.cwiseMax(node.box.lo).cwiseMin(node.box.hi);
        if ((nearest - p).squaredNorm() > radius_sq) return;
        if (node.right != kNoIndex) {
            descend(id + 1, p, radius_sq, visit);
            descend(node.right, p, radius_sq, visit);
            return;
        }
        for (Index i = node.begin; i < node.end; ++i) {
            const double distance_sq = (points_[i] - p).squaredNorm();
            if (distance_sq <= radius_sq) visit(order_[i], distance_sq);
        }
    }

    template <class Visit>
    void descend_below(Index id, const Vec3& p, double reach, std::span<const double> most, Visit& visit) const {
        const Node& node = nodes_[id];
        const double radius = (reach + most[id]) * (1.0 + 1e-12);
        if (!(radius > 0.0) || box_distance_sq(node.box, p) > radius * radius) return;
        if (node.right != kNoIndex) {
            descend_below(id + 1, p, reach, most, visit);
            descend_below(node.right, p, reach, most, visit);
            return;
        }
        for (Index i = node.begin; i < node.end; ++i) {
            const double distance_sq = (points_[i] - p).squaredNorm();
            if (distance_sq <= radius * radius) visit(order_[i], distance_sq);
        }
    }

    std::vector<Node> nodes_;  // depth first
    std::vector<Index> order_; // [slot] point id
    std::vector<Vec3> points_; // [slot]
};

} // namespace trocar::spheretree
