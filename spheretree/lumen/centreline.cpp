#include "spheretree/lumen/centreline.hpp"

#include "spheretree/lumen/lumen_path.hpp"

#include <algorithm>
#include <limits>

namespace trocar::spheretree {

namespace {

/// Of a ball's radius: a point so near to its middle lies in a vessel as wide as the ball.
constexpr double kMiddle = 0.5;

class Grower {
public:
    Grower(const LumenTree& lumen, const Vec3& root, const CentrelineOptions& options) : lumen_(lumen), root_(root), options_(options) {}

    Result<CentrelineTree> grow() {
        Result<std::vector<double>> lengths = find_way_lengths(lumen_, root_);
        if (!lengths) return lengths.error();
        waiting_ = std::move(*lengths);
        for (Index& ball = farthest_; find_farthest(); waiting_[ball] = -1.0) {
            const auto path = find_lumen_path(lumen_, root_, lumen_.ball(ball).centre, {0.0, options_.spacing, options_.smoothing});
            if (path) add_branch(*path);
        }
        return std::move(tree_);
    }

private:
    /// The sphere with the longest path to it, of those that no branch covers.
    bool find_farthest() {
        double most = -1.0;
        for (Index ball = 0; ball < waiting_.size(); ++ball)
            if (waiting_[ball] > most && waiting_[ball] < std::numeric_limits<double>::infinity()) {
                most = waiting_[ball];
                farthest_ = ball;
            }
        return most >= 0.0;
    }

    [[nodiscard]] Index nearest_point(const Vec3& p) const {
        Index nearest = kNoIndex;
        double least = std::numeric_limits<double>::infinity();
        for (Index i = 0; i < tree_.point_count(); ++i)
            if (const double distance = (tree_.points[i] - p).squaredNorm(); distance < least) {
                least = distance;
                nearest = i;
            }
        return nearest;
    }

    /// The part of the path that is not in the tree yet: from the last point that lies on it.
    void add_branch(const std::vector<LumenPathPoint>& path) {
        std::size_t begin = path.size();
        Index parent = kNoIndex;
        for (; begin > 0 && tree_.point_count() > 0; --begin) {
            parent = nearest_point(path[begin - 1].centre);
            if ((tree_.points[parent] - path[begin - 1].centre).norm() <= options_.join * tree_.radii[parent]) break;
        }
        if (tree_.point_count() == 0) begin = 0;
        if (begin == 0) parent = tree_.point_count() == 0 ? kNoIndex : 0;
        for (std::size_t k = begin; k < path.size(); ++k) {
            tree_.points.push_back(path[k].centre);
            tree_.radii.push_back(see(path[k]));
            tree_.parents.push_back(parent);
            parent = static_cast<Index>(tree_.point_count() - 1);
        }
    }

    /// Marks the spheres near the point as covered.
    /// returns  m, the vessel's radius there; find_lumen_path's clearance is another measure, of the union of spheres
    double see(const LumenPathPoint& point) {
        double radius = 0.0;
        for (Index ball = 0; ball < waiting_.size(); ++ball) {
            const Sphere& free = lumen_.ball(ball);
            if ((free.centre - point.centre).squaredNorm() <= kMiddle * kMiddle * free.radius * free.radius)
                radius = std::max(radius, free.radius);
        }
        if (radius == 0.0) radius = std::max(point.radius, 0.0); // off the middle of every ball
        const double reach = options_.seen * radius;
        for (Index ball = 0; ball < waiting_.size(); ++ball)
            if ((lumen_.ball(ball).centre - point.centre).squaredNorm() <= reach * reach) waiting_[ball] = -1.0;
        return radius;
    }

    const LumenTree& lumen_;
    Vec3 root_;
    CentrelineOptions options_;
    std::vector<double> waiting_; // [ball_count] m of path; negative: covered; infinite: unreachable
    CentrelineTree tree_;
    Index farthest_ = 0;
};

} // namespace

Result<CentrelineTree> find_centreline_tree(const LumenTree& lumen, const Vec3& root, const CentrelineOptions& options) {
    return Grower(lumen, root, options).grow();
}

} // namespace trocar::spheretree
