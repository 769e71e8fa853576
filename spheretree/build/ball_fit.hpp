// Balls that hold given points and reach as little as possible outside a body.
//
// A ball whose centre lies `depth` inside the body and whose radius is r reaches outside by r - depth at most: every ray from
// the centre meets the surface no nearer than the depth. This bound, the overhang, is what the builders minimise.
#pragma once

#include "base/inside.hpp"
#include "spheretree/build/point_tree.hpp"
#include "spheretree/sphere_tree.hpp"

#include <optional>

namespace trocar::spheretree {

/// Depth of points inside a body (negative signed distance).
class BodyDepth {
public:
    /// A surface without an inside has depth 0 everywhere: balls are then as small as can be.
    BodyDepth(const TriMesh& surface, bool solid) : inside_(surface), solid_(solid) {}

    /// Points of the surface, no farther than `spacing` [m] apart: where the surface is much farther away than that, walks measure
    /// to them. Measuring to the triangles themselves costs five times as much.
    void set_cloud(std::span<const Vec3> points, double spacing) {
        cloud_.assign(points.begin(), points.end());
        cloud_tree_.emplace(cloud_);
        spacing_ = spacing;
    }

    [[nodiscard]] bool solid() const noexcept { return solid_; }
    [[nodiscard]] const InsideTest& inside() const noexcept { return inside_; }
    /// m; negative outside.
    [[nodiscard]] double at(const Vec3& p) const noexcept { return solid_ ? -inside_.signed_distance(p) : 0.0; }
    /// Nearest place of the surface, about; p itself where the surface has no inside.
    [[nodiscard]] Vec3 nearest(const Vec3& p, double reach) const noexcept {
        if (!solid_) return p;
        if (cloud_tree_ && reach > kFar * spacing_) {
            double distance = 0.0;
            const Index id = cloud_tree_->nearest(p, reach + 0.5 * spacing_, distance);
            if (id != kNoIndex && distance > kFar * spacing_) return cloud_[id];
        }
        const auto hit = inside_.tree().closest(p, reach);
        return hit ? hit->point : p;
    }

private:
    static constexpr double kFar = 2.0; // times the spacing
    InsideTest inside_;
    bool solid_;
    std::vector<Vec3> cloud_;
    std::optional<PointTree> cloud_tree_;
    double spacing_ = 0.0;
};

struct Ball {
    Vec3 centre = Vec3::Zero(); // m
    double depth = 0.0;         // m, of the centre inside the body; negative outside
    double radius = 0.0;        // m
    [[nodiscard]] double overhang() const noexcept { return radius - depth; }
};

/// Walks the centre towards the farthest point and away from the nearest surface, steps shrinking, and keeps the best ball
/// seen. The centre stays on its side of the surface; the depth of the result is exact.
/// points   ids of what the ball must hold, not empty
/// source   Badoiu & Clarkson 2003 (walk to the farthest point). Deviates: the surface pushes the centre back.
[[nodiscard]] Ball fit_ball(const Ball& start, std::span<const Vec3> points, std::span<const Index> ids, const BodyDepth& body,
                            unsigned steps);

} // namespace trocar::spheretree
