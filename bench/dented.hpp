// A surface that crosses itself: its highest point pushed down through what lies below it.
#pragma once

#include "base/mesh.hpp"

#include <cmath>

namespace trocar::engine {

/// A smooth dent (Gaussian, 8 % of the longest edge of the bounds wide), 1.1 times as deep as the surface is high.
/// mesh    with at least one vertex, up along y
inline void push_top_down(TriMesh& mesh) {
    Index top = 0;
    for (Index v = 0; v < mesh.vertices.size(); ++v)
        if (mesh.vertices[v].y() > mesh.vertices[top].y()) top = v;
    const Vec3 peak = mesh.vertices[top];
    const double height = mesh.bounds().extent().y(), radius = 0.08 * mesh.bounds().longest_edge();
    for (Vec3& v : mesh.vertices) v.y() -= 1.1 * height * std::exp(-(v - peak).squaredNorm() / (radius * radius));
}

} // namespace trocar::engine
