#include "engine/report/outline.hpp"

#include <algorithm>
#include <tuple>

namespace trocar::engine {

std::vector<OutlineEdge> find_outline(const TriMesh& mesh, const Vec3& view_direction) {
    struct Side {
        Index a, b;
        bool faces_away;
    };
    std::vector<Side> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
        const Vec3 normal = (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
        const bool faces_away = normal.dot(view_direction) > 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
            sides.push_back({a, b, faces_away});
        }
    }
    std::sort(sides.begin(), sides.end(),
              [](const Side& p, const Side& q) { return std::tie(p.a, p.b, p.faces_away) < std::tie(q.a, q.b, q.faces_away); });
    std::vector<OutlineEdge> outline;
    for (std::size_t i = 0, next = 0; i < sides.size(); i = next) {
        while (next < sides.size() && sides[next].a == sides[i].a && sides[next].b == sides[i].b) ++next;
        const bool border = next == i + 1;
        if (border || sides[i].faces_away != sides[next - 1].faces_away)
            outline.push_back({mesh.vertices[sides[i].a], mesh.vertices[sides[i].b]});
    }
    return outline;
}

} // namespace trocar::engine
