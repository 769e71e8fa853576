// Surface and volume meshes as plain arrays: what readers return and every algorithm takes.
#pragma once

#include "base/box.hpp"
#include "base/vec.hpp"

#include <string>
#include <vector>

namespace trocar {

/// Triangle surface. Closed surfaces are oriented outwards (positive signed volume).
struct TriMesh {
    std::vector<Vec3> vertices;      // [vertex_count] m
    std::vector<Triangle> triangles; // [triangle_count] vertex ids, counter-clockwise seen from outside

    [[nodiscard]] Box3 bounds() const noexcept {
        Box3 box;
        for (const Triangle& t : triangles)
            for (const Index v : t) box.add(vertices[v]);
        return box;
    }
};

/// Linear tetrahedra. Positively oriented: (x1 - x0) . ((x2 - x0) x (x3 - x0)) > 0.
struct TetMesh {
    std::vector<Vec3> vertices; // [node_count] m
    std::vector<Tet> tets;      // [tet_count] node ids
};

} // namespace trocar
