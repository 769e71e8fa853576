#include "engine/importing/openings.hpp"

#include "base/inside.hpp"
#include "base/topology.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace trocar::engine {

namespace {

/// Mean of |wall normal . loop axis| below which a wall runs along the axis: 0 for a tube that is cut square, 1 for a hole in a wall.
constexpr double kAlongAxis = 0.7;
/// Of the loop's radius: root mean square distance from its plane.
constexpr double kFlat = 0.4;
/// Fewest edges of an opening: a vessel that is cut across has more, a missing triangle three.
constexpr std::size_t kLeastEdges = 4;
/// Of an opening's radius: how far from the cap a place inside is looked for.
constexpr double kInside = 0.25;

struct BorderLoop {
    std::vector<Index> vertices;
    std::vector<Index> triangles; // along it
};

/// Border edges followed from vertex to vertex; where several leave a vertex, any that is left.
std::vector<BorderLoop> trace_border(const TriMesh& mesh) {
    struct Step {
        Index to, triangle;
        bool used = false;
    };
    std::map<Index, std::vector<Step>> steps; // both ways: neighbours may be turned apart
    for_each_edge(sorted_edge_uses(mesh.triangles), [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 1) return;
        steps[edge[0].lo].push_back({edge[0].hi, edge[0].triangle});
        steps[edge[0].hi].push_back({edge[0].lo, edge[0].triangle});
    });
    const auto take = [&](Index from, Index to) {
        for (Step& back : steps[to])
            if (back.to == from && !back.used) {
                back.used = true;
                return;
            }
    };
    std::vector<BorderLoop> loops;
    for (auto& [start, leaving] : steps)
        for (std::size_t first = 0; first < leaving.size(); ++first) {
            if (leaving[first].used) continue;
            BorderLoop loop;
            Index at = start;
            for (;;) {
                std::vector<Step>& here = steps[at];
                const auto next = std::find_if(here.begin(), here.end(), [](const Step& step) { return !step.used; });
                if (next == here.end()) break;
                next->used = true;
                const Index to = next->to;
                loop.vertices.push_back(at);
                loop.triangles.push_back(next->triangle);
                take(at, to);
                at = to;
                if (at == start) break;
            }
            if (at == start && loop.vertices.size() >= 3) loops.push_back(std::move(loop));
        }
    return loops;
}

Vec3 unit_normal(const TriMesh& mesh, Index triangle) {
    const Triangle& t = mesh.triangles[triangle];
    return (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).normalized();
}

/// An opening, or a radius of 0.
VesselEnd measure(const TriMesh& mesh, const BorderLoop& loop) {
    VesselEnd end;
    double length = 0.0;
    for (std::size_t i = 0; i < loop.vertices.size(); ++i) {
        const Vec3 &a = mesh.vertices[loop.vertices[i]], &b = mesh.vertices[loop.vertices[(i + 1) % loop.vertices.size()]];
        const double edge = (b - a).norm();
        end.centre += 0.5 * edge * (a + b);
        length += edge;
    }
    if (!(length > 0.0)) return end;
    end.centre /= length;
    Vec3 area = Vec3::Zero();
    for (std::size_t i = 0; i < loop.vertices.size(); ++i)
        area += 0.5 * (mesh.vertices[loop.vertices[i]] - end.centre)
                          .cross(mesh.vertices[loop.vertices[(i + 1) % loop.vertices.size()]] - end.centre);
    if (!(area.norm() > 0.0)) return end;
    end.inward = area.normalized();
    const double radius = std::sqrt(area.norm() / std::numbers::pi);
    double along = 0.0, off = 0.0;
    for (std::size_t i = 0; i < loop.vertices.size(); ++i) {
        const Vec3 normal = unit_normal(mesh, loop.triangles[i]);
        along += normal.allFinite() ? std::abs(normal.dot(end.inward)) : 0.0;
        off += std::pow((mesh.vertices[loop.vertices[i]] - end.centre).dot(end.inward), 2);
    }
    const auto count = static_cast<double>(loop.vertices.size());
    if (along < kAlongAxis * count && std::sqrt(off / count) < kFlat * radius) end.radius = radius;
    return end;
}

} // namespace

std::vector<VesselEnd> find_openings(const TriMesh& mesh) {
    std::vector<VesselEnd> ends;
    for (const BorderLoop& loop : trace_border(mesh)) {
        if (loop.vertices.size() < kLeastEdges) continue;
        if (const VesselEnd end = measure(mesh, loop); end.radius > 0.0) ends.push_back(end);
    }
    return ends;
}

void point_inward(std::vector<VesselEnd>& ends, const TriMesh& closed) {
    const InsideTest inside(closed);
    std::erase_if(ends, [&](VesselEnd& end) {
        const Vec3 ahead = end.centre + kInside * end.radius * end.inward, behind = end.centre - kInside * end.radius * end.inward;
        const bool in_ahead = inside.inside(ahead), in_behind = inside.inside(behind);
        if (in_behind && !in_ahead) end.inward = -end.inward;
        return in_ahead == in_behind;
    });
}

} // namespace trocar::engine
