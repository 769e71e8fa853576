// Axes across the rod, carried along it from node to node.
#pragma once

#include "fem/rod/rod_model.hpp"

#include <span>

namespace trocar::fem {

/// Material axis m1 at every node: the port's reference axis turned by `rotation`, carried along without twist; with
/// torsion turned by the node's own angle instead.
void carry_material_axis(const RodModel& model, const RodState& state, const RodPort& port, std::span<Vec3> axis) noexcept;

/// Where the frames begin: at the port, or at the first segment of a rod that has left it.
struct FrameStart {
    Vec3 direction, axis; // unit, at right angles
};
[[nodiscard]] FrameStart frame_start(const RodState& state, const RodPort& port) noexcept;

/// A rod with torsion that has just left its port: its frames go on from the first segment as they were.
void free_frames(const RodPort& port, RodState& state) noexcept;

/// Where the frames of a free rod begin that was at `from` and whose positions are now these: by its first segment's turn.
[[nodiscard]] Vec3 move_root(const RodState& from, std::span<const Vec3> position) noexcept;

/// Unit chord of node i's neighbours; `fallback` where they coincide.
[[nodiscard]] Vec3 rod_tangent(std::span<const Vec3> position, std::size_t i, const Vec3& fallback) noexcept;

/// Direction of the segment after node i; `fallback` where it has no length.
[[nodiscard]] Vec3 rod_edge(std::span<const Vec3> position, std::size_t i, const Vec3& fallback) noexcept;

/// `axis` carried on to a node with this tangent by projection: parallel transport but for half the square of the turn.
[[nodiscard]] Vec3 carry_axis(const Vec3& axis, const Vec3& tangent) noexcept;

/// `axis` carried from one tangent to the next by the shortest rotation: parallel transport.
[[nodiscard]] Vec3 transport_axis(const Vec3& axis, const Vec3& from, const Vec3& to) noexcept;

/// Any unit vector at right angles to `direction`, the same for the same input on every machine.
[[nodiscard]] Vec3 perpendicular_axis(const Vec3& direction) noexcept;

/// The reference axis where the frames begin carried along the rod without twist, over its nodes and the segments between them: what it has
/// turned by at a node is what bending has twisted the segments by. Calls at(node, tangent, axis, edge); edge:
/// the direction of the segment after the node, of the last one its tangent.
template <class At>
void carry_along(std::span<const Vec3> position, const FrameStart& start, At&& at) noexcept {
    Vec3 axis = start.axis, last = start.direction;
    for (std::size_t i = 0; i < position.size(); ++i) {
        const Vec3 tangent = rod_tangent(position, i, start.direction);
        axis = transport_axis(axis, last, tangent);
        last = i + 1 < position.size() ? rod_edge(position, i, tangent) : tangent;
        at(i, tangent, axis, last);
        axis = transport_axis(axis, tangent, last);
    }
}

} // namespace trocar::fem
