#include "spheretree/bounding.hpp"

namespace trocar::spheretree {

namespace {

/// Sphere whose far side is farthest from `centre`; the first of equals. kNoIndex: all are empty.
Index farthest(const Vec3& centre, std::span<const Sphere> balls) noexcept {
    Index best = kNoIndex;
    double reach = -1.0;
    for (Index i = 0; i < balls.size(); ++i) {
        if (balls[i].radius < 0.0) continue;
        const double r = (balls[i].centre - centre).norm() + balls[i].radius;
        if (best == kNoIndex || r > reach) {
            best = i;
            reach = r;
        }
    }
    return best;
}

} // namespace

Sphere enclose(std::span<const Sphere> balls, unsigned rounds) noexcept {
    const Index seed = farthest(Vec3::Zero(), balls);
    if (seed == kNoIndex) return {};
    const Index a = farthest(balls[seed].centre, balls);
    const Index b = farthest(balls[a].centre, balls);
    Sphere best = enclose_two(balls[a], balls[b]);
    best.radius = enclosing_radius(best.centre, balls);
    Vec3 centre = best.centre;
    for (unsigned round = 0; round < rounds; ++round) {
        const Sphere& far = balls[farthest(centre, balls)];
        const Vec3 across = far.centre - centre;
        const double distance = across.norm();
        if (distance <= 0.0) break;
        centre += across * ((distance + far.radius) / distance / (round + 4.0) * 0.5);
        const double radius = enclosing_radius(centre, balls);
        if (radius < best.radius) best = {centre, radius};
    }
    return best;
}

} // namespace trocar::spheretree
