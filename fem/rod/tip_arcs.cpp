#include "fem/rod/tip_arcs.hpp"

#include "base/trig.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trocar::fem {

namespace {

/// Frame that is carried along a curve: turned by the smallest rotation from direction to direction.
struct Frame {
    Vec3 along = Vec3::UnitZ(), first = Vec3::UnitX(); // unit, across each other

    [[nodiscard]] Vec3 second() const noexcept { return along.cross(first); }

    /// Towards the side at an angle in the frame.
    void turn(double angle, double plane) noexcept {
        const SinCos side = sin_cos(plane);
        const Mat3 rotation = rotation_about(along.cross(side.cos * first + side.sin * second()), angle);
        along = (rotation * along).normalized();
        first = rotation * first;
        first = (first - first.dot(along) * along).normalized();
    }
};

} // namespace

std::array<double, 2> turn_of_arcs(std::span<const TipArc> arcs, double from, double to) noexcept {
    std::array<double, 2> turn{0.0, 0.0};
    double begin = 0.0;
    for (const TipArc& arc : arcs) {
        const double end = begin + arc.length, inside = std::min(to, end) - std::max(from, begin);
        if (inside > 0.0 && arc.angle != 0.0) {
            const SinCos side = sin_cos(arc.plane);
            const double angle = arc.angle * (inside / arc.length);
            turn[0] += angle * side.cos, turn[1] += angle * side.sin;
        }
        begin = end;
    }
    return turn;
}

std::vector<TipArc> arcs_along(std::span<const Vec3> line) {
    assert(line.size() >= 3);
    Frame frame;
    frame.along = (line[1] - line[0]).normalized();
    const Vec3 offset = line.back() - line.front();
    Vec3 side = offset - offset.dot(frame.along) * frame.along;
    if (!(side.norm() > 1e-9 * offset.norm())) side = frame.along.unitOrthogonal();
    frame.first = side.normalized();
    std::vector<TipArc> arcs{{0.5 * (line[1] - line[0]).norm(), 0.0, 0.0}};
    for (std::size_t k = 1; k + 1 < line.size(); ++k) {
        const Vec3 after = line[k + 1] - line[k];
        const Vec3 direction = after.normalized(), across = direction - direction.dot(frame.along) * frame.along;
        const double angle = std::atan2(across.norm(), direction.dot(frame.along));
        const double plane = angle > 0.0 ? std::atan2(across.dot(frame.second()), across.dot(frame.first)) : 0.0;
        arcs.push_back({0.5 * ((line[k] - line[k - 1]).norm() + after.norm()), angle, plane});
        frame.turn(angle, plane);
        frame.along = direction;
    }
    arcs.push_back({0.5 * (line[line.size() - 1] - line[line.size() - 2]).norm(), 0.0, 0.0});
    return arcs;
}

std::vector<Vec3> draw_arcs(std::span<const TipArc> arcs, std::size_t count) {
    double length = 0.0;
    for (const TipArc& arc : arcs) length += arc.length;
    const double step = length / static_cast<double>(count);
    Frame frame;
    std::vector<Vec3> line{Vec3::Zero()};
    for (std::size_t k = 0; k < count; ++k) { // along the chord of what it turns by on the way
        const std::array<double, 2> turn = turn_of_arcs(arcs, step * static_cast<double>(k), step * static_cast<double>(k + 1));
        const double angle = size_of(turn), plane = std::atan2(turn[1], turn[0]);
        frame.turn(0.5 * angle, plane);
        const double chord = angle > 1e-9 ? 2.0 * sin_cos(0.5 * angle).sin / angle : 1.0;
        line.push_back(line.back() + chord * step * frame.along);
        frame.turn(0.5 * angle, plane);
    }
    return line;
}

} // namespace trocar::fem
