#include "spheretree/build/ball_fit.hpp"

#include <cmath>

namespace trocar::spheretree {

namespace {

constexpr double kShrink = 0.85;     // [-] of the step, each time
constexpr double kFirstStep = 0.5;   // of the overhang
constexpr double kLargestStep = 0.9; // of the distance to the surface: a centre never crosses it

struct Farthest {
    Index id = kNoIndex;
    double distance_sq = -1.0;
};

Farthest find_farthest(const Vec3& centre, std::span<const Vec3> points, std::span<const Index> ids) noexcept {
    Farthest best;
    for (const Index id : ids) {
        const double d = (points[id] - centre).squaredNorm();
        if (d > best.distance_sq) best = {id, d};
    }
    return best;
}

} // namespace

Ball fit_ball(const Ball& start, std::span<const Vec3> points, std::span<const Index> ids, const BodyDepth& body, unsigned steps) {
    Vec3 centre = start.centre;
    double depth = start.depth;
    Farthest far = find_farthest(centre, points, ids);
    Ball best{centre, depth, std::sqrt(far.distance_sq)};
    const Ball first = best;
    double step = kFirstStep * std::max(best.overhang(), 0.0);
    for (unsigned k = 0; k < steps && step > 0.0; ++k, step *= kShrink) {
        const double radius = std::sqrt(far.distance_sq), room = std::abs(depth);
        Vec3 direction = radius > 0.0 ? Vec3((points[far.id] - centre) / radius) : Vec3(Vec3::Zero());
        if (body.solid() && room > 0.0) {
            const Vec3 nearest = body.nearest(centre, 1.000001 * room);
            direction += (centre - nearest) / (depth > 0.0 ? room : -room);
        }
        const double length = direction.norm();
        if (!(length > 1e-9)) break;
        const double stride = body.solid() && depth > 0.0 ? std::min(step, kLargestStep * depth) : step;
        centre += direction * (stride / length);
        if (body.solid()) {
            if (depth > 0.0)
                depth = (centre - body.nearest(centre, depth + 1.000001 * stride)).norm();
            else
                depth = body.at(centre);
        }
        far = find_farthest(centre, points, ids);
        const double reached = std::sqrt(far.distance_sq);
        if (reached - depth < best.overhang()) best = {centre, depth, reached};
    }
    if (body.solid() && best.centre != start.centre) { // steps use approximate depths; the result is judged by the surface itself
        const auto hit = body.inside().tree().closest(best.centre, std::abs(best.depth) * 1.000001);
        if (hit) best.depth = best.depth < 0.0 ? -hit->distance : hit->distance;
        if (best.overhang() > first.overhang()) return first;
    }
    return best;
}

} // namespace trocar::spheretree
