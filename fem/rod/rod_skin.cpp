#include "fem/rod/rod_skin.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::fem {

namespace {

/// The caps' apex stands this fraction of the radius beyond the end node: inside the end node's sphere.
constexpr double kCapHeight = 0.6;

} // namespace

RodSkin make_rod_skin(const RodModel& model, std::size_t triangle_count) {
    RodSkin skin;
    const std::size_t nodes = model.node_count();
    const double per_side = 2.0 * static_cast<double>(nodes - 1) + 2.0;
    skin.sides = static_cast<unsigned>(std::max(6.0, std::round(static_cast<double>(triangle_count) / per_side)));
    const Index sides = skin.sides;
    for (unsigned s = 0; s < sides; ++s) skin.turn.push_back(sin_cos(2.0 * std::numbers::pi / sides * s));
    for (Index i = 0; i < nodes; ++i) skin.vertex_node.insert(skin.vertex_node.end(), sides, i);
    const Index back = static_cast<Index>(skin.vertex_node.size()), front = back + 1;
    skin.vertex_node.push_back(0);
    skin.vertex_node.push_back(static_cast<Index>(nodes - 1));
    for (Index i = 0; i + 1 < nodes; ++i)
        for (Index s = 0; s < sides; ++s) {
            const Index a = i * sides + s, b = i * sides + (s + 1) % sides;
            skin.triangles.push_back({a, b, a + sides});
            skin.triangles.push_back({b, b + sides, a + sides});
        }
    const Index last = static_cast<Index>(nodes - 1) * sides;
    for (Index s = 0; s < sides; ++s) {
        skin.triangles.push_back({back, (s + 1) % sides, s});
        skin.triangles.push_back({front, last + s, last + (s + 1) % sides});
    }
    return skin;
}

void place_rod_skin(const RodModel& model, const RodSkin& skin, const RodState& state, const RodPort& port, std::span<Vec3> axis,
                    std::span<Vec3> vertex) noexcept {
    carry_material_axis(model, state, port, axis);
    const std::size_t nodes = model.node_count();
    const Index first = first_inserted_node(model, state.insertion);
    const double radius = model.design.radius;
    const auto frame_tangent = [&](std::size_t i) {
        if (i < first) return port.direction;
        const Vec3 chord = state.position[std::min(i + 1, nodes - 1)] - state.position[i > 0 ? i - 1 : 0];
        const double length = std::sqrt(chord.squaredNorm());
        return length > 0.0 ? Vec3(chord / length) : port.direction;
    };
    for (std::size_t i = 0; i < nodes; ++i) {
        const Vec3 centre = i < first ? port.position : state.position[i];
        const Vec3 tangent = frame_tangent(i);
        const Vec3 across = tangent.cross(axis[i]);
        for (unsigned s = 0; s < skin.sides; ++s) {
            vertex[i * skin.sides + s] = centre + radius * (skin.turn[s].cos * axis[i] + skin.turn[s].sin * across);
        }
    }
    const Vec3 back = first > 0 ? port.position : state.position.front();
    const Vec3 tip = first >= nodes ? port.position : state.position.back();
    vertex[nodes * skin.sides] = back - kCapHeight * radius * frame_tangent(0);
    vertex[nodes * skin.sides + 1] = tip + kCapHeight * radius * frame_tangent(nodes - 1);
}

} // namespace trocar::fem
