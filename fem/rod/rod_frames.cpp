#include "fem/rod/rod_frames.hpp"

#include "base/trig.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

Vec3 perpendicular_axis(const Vec3& direction) noexcept {
    int smallest = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::abs(direction[axis]) < std::abs(direction[smallest])) smallest = axis;
    const Vec3 across = direction.cross(Vec3::Unit(smallest));
    return across / std::sqrt(across.squaredNorm());
}

Vec3 rod_tangent(std::span<const Vec3> position, std::size_t i, const Vec3& fallback) noexcept {
    const Vec3 chord = position[std::min(i + 1, position.size() - 1)] - position[i > 0 ? i - 1 : 0];
    const double length = std::sqrt(chord.squaredNorm());
    return length > 0.0 ? Vec3(chord / length) : fallback;
}

Vec3 rod_edge(std::span<const Vec3> position, std::size_t i, const Vec3& fallback) noexcept {
    const Vec3 edge = position[i + 1] - position[i];
    const double length = std::sqrt(edge.squaredNorm());
    return length > 0.0 ? Vec3(edge / length) : fallback;
}

Vec3 carry_axis(const Vec3& axis, const Vec3& tangent) noexcept {
    const Vec3 projected = axis - axis.dot(tangent) * tangent;
    const double length = std::sqrt(projected.squaredNorm());
    return length > 1e-6 ? Vec3(projected / length) : perpendicular_axis(tangent);
}

Vec3 transport_axis(const Vec3& axis, const Vec3& from, const Vec3& to) noexcept {
    const double room = 1.0 + from.dot(to);
    return carry_axis(room > 1e-6 ? Vec3(axis - axis.dot(to) / room * (from + to)) : axis, to); // and no drift by rounding
}

FrameStart frame_start(const RodState& state, const RodPort& port) noexcept {
    if (state.root.isZero(0.0)) return {port.direction, perpendicular_axis(port.direction)};
    const Vec3 tangent = rod_tangent(state.position, 0, port.direction);
    return {tangent, carry_axis(state.root, tangent)};
}

void free_frames(const RodPort& port, RodState& state) noexcept {
    const FrameStart start = frame_start(state, port);
    state.root = transport_axis(start.axis, start.direction, rod_tangent(state.position, 0, port.direction));
}

Vec3 move_root(const RodState& from, std::span<const Vec3> position) noexcept {
    const Vec3 before = rod_tangent(from.position, 0, Vec3::UnitZ());
    return transport_axis(from.root, before, rod_tangent(position, 0, before));
}

void carry_material_axis(const RodModel& model, const RodState& state, const RodPort& port, std::span<Vec3> axis) noexcept {
    if (!state.angle.empty()) {
        carry_along(state.position, frame_start(state, port), [&](std::size_t i, const Vec3& tangent, const Vec3& m, const Vec3&) {
            const SinCos here = sin_cos(state.angle[i]);
            axis[i] = here.cos * m + here.sin * tangent.cross(m);
        });
        return;
    }
    const SinCos turn = sin_cos(state.rotation);
    const Vec3 reference = perpendicular_axis(port.direction);
    Vec3 m = turn.cos * reference + turn.sin * port.direction.cross(reference);
    for (std::size_t i = 0; i < model.node_count(); ++i) {
        m = carry_axis(m, rod_tangent(state.position, i, port.direction));
        axis[i] = m;
    }
}

} // namespace trocar::fem
