#include "engine/prepare/pulse.hpp"

#include "base/topology.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

constexpr int kSmoothings = 20; // rounds over the edges: a few triangles far

std::vector<Vec3> find_outward_normals(const TriMesh& wall) {
    std::vector<Vec3> normals(wall.vertices.size(), Vec3::Zero());
    for (const Triangle& t : wall.triangles) {
        const Vec3 area = (wall.vertices[t[1]] - wall.vertices[t[0]]).cross(wall.vertices[t[2]] - wall.vertices[t[0]]);
        for (const Index v : t) normals[v] += area;
    }
    for (Vec3& n : normals) {
        const double length = n.norm();
        n = length > 0.0 ? Vec3(n / length) : Vec3(Vec3::Zero());
    }
    return normals;
}

/// 0 where no ball of the cover touches.
std::vector<double> find_radii(const TriMesh& wall, const spheretree::LumenTree& lumen) {
    std::vector<double> radii(wall.vertices.size(), 0.0);
    for (Index ball = 0; ball < lumen.ball_count(); ++ball)
        for (const Index triangle : lumen.wall_of(ball))
            for (const Index v : wall.triangles[triangle]) radii[v] = std::max(radii[v], lumen.ball(ball).radius);
    return radii;
}

/// Every value becomes the mean of its neighbours' and its own; those that are 0 take part only as receivers.
void smooth(const std::vector<std::array<Index, 2>>& edges, std::vector<double>& values) {
    std::vector<double> sum(values.size()), count(values.size());
    for (int round = 0; round < kSmoothings; ++round) {
        for (std::size_t v = 0; v < values.size(); ++v) sum[v] = values[v], count[v] = values[v] > 0.0 ? 1.0 : 0.0;
        for (const auto& [a, b] : edges) {
            if (values[b] > 0.0) sum[a] += values[b], count[a] += 1.0;
            if (values[a] > 0.0) sum[b] += values[a], count[b] += 1.0;
        }
        for (std::size_t v = 0; v < values.size(); ++v)
            if (count[v] > 0.0) values[v] = sum[v] / count[v];
    }
}

} // namespace

std::vector<Vec3> find_pulse_reach(const TriMesh& wall, const spheretree::LumenTree& lumen, double amplitude) {
    std::vector<double> radii = find_radii(wall, lumen);
    smooth(unique_edges(wall.triangles), radii);
    std::vector<Vec3> reach = find_outward_normals(wall);
    for (std::size_t v = 0; v < reach.size(); ++v) reach[v] *= amplitude * radii[v];
    return reach;
}

} // namespace trocar::engine
