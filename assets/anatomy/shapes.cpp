#include "assets/anatomy/shapes.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>

namespace trocar::anatomy {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Adds the two triangles of a quad given counter-clockwise.
void add_quad(TriMesh& mesh, Index a, Index b, Index c, Index d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
}

/// Grid of cells x cells quads over a face; u x v points outwards. Vertices shared with other faces are found by position id.
void add_face(TriMesh& mesh, std::map<std::array<int, 3>, Index>& ids, const Box3& box, int axis, int side, int cells) {
    const int u = (axis + (side > 0 ? 1 : 2)) % 3, v = (axis + (side > 0 ? 2 : 1)) % 3;
    const auto vertex = [&](int i, int j) {
        std::array<int, 3> at{};
        at[static_cast<std::size_t>(axis)] = side > 0 ? cells : 0;
        at[static_cast<std::size_t>(u)] = i;
        at[static_cast<std::size_t>(v)] = j;
        const auto [slot, fresh] = ids.try_emplace(at, static_cast<Index>(mesh.vertices.size()));
        if (fresh) {
            const Vec3 share(at[0], at[1], at[2]);
            mesh.vertices.push_back(box.lo + box.extent().cwiseProduct(share / cells));
        }
        return slot->second;
    };
    for (int i = 0; i < cells; ++i)
        for (int j = 0; j < cells; ++j) add_quad(mesh, vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
}

/// Ring of `sides` vertices around `centre`, counter-clockwise about u x v.
void add_ring(TriMesh& mesh, const Vec3& centre, const Vec3& u, const Vec3& v, double radius, int sides) {
    for (int k = 0; k < sides; ++k) {
        const double angle = 2 * kPi * k / sides;
        mesh.vertices.push_back(centre + radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
}

/// Wall between two rings; the second lies ahead along u x v.
void add_band(TriMesh& mesh, Index first_ring, Index second_ring, int sides) {
    for (int k = 0; k < sides; ++k) {
        const auto a = static_cast<Index>(k), b = static_cast<Index>((k + 1) % sides);
        add_quad(mesh, first_ring + a, first_ring + b, second_ring + b, second_ring + a);
    }
}

struct Frame {
    Vec3 ahead, u, v; // right-handed: u x v = ahead
};

/// Frames along a polyline that turn about the axis as little as possible.
std::vector<Frame> carry_frames(std::span<const Vec3> points) {
    std::vector<Frame> frames;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3& before = points[i > 0 ? i - 1 : 0];
        const Vec3& after = points[std::min(i + 1, points.size() - 1)];
        Frame f;
        f.ahead = (after - before).normalized();
        Vec3 side = i > 0 ? frames.back().u : Vec3::Zero();
        if (i == 0) {
            int least = 0;
            f.ahead.cwiseAbs().minCoeff(&least);
            side[least] = 1.0;
        }
        f.u = (side - side.dot(f.ahead) * f.ahead).normalized();
        f.v = f.ahead.cross(f.u);
        frames.push_back(f);
    }
    return frames;
}

} // namespace

TriMesh make_icosphere(const Vec3& centre, double radius, int subdivisions) {
    const double g = 0.5 * (1 + std::sqrt(5.0));
    TriMesh mesh;
    mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    mesh.triangles = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2}, {3, 2, 6}, {3, 6, 8},  {3, 8, 9},   {4, 9, 5}, {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (int round = 0; round < subdivisions; ++round) {
        std::map<std::pair<Index, Index>, Index> middles;
        const auto middle = [&](Index a, Index b) {
            const auto [slot, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<Index>(mesh.vertices.size()));
            if (fresh) mesh.vertices.push_back((mesh.vertices[a].normalized() + mesh.vertices[b].normalized()).eval());
            return slot->second;
        };
        std::vector<Triangle> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    for (Vec3& v : mesh.vertices) v = centre + radius * v.normalized();
    return mesh;
}

TriMesh make_box(const Vec3& centre, const Vec3& extent, int cells) {
    assert(cells >= 1);
    Box3 box;
    box.add(centre - 0.5 * extent);
    box.add(centre + 0.5 * extent);
    TriMesh mesh;
    std::map<std::array<int, 3>, Index> ids;
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) add_face(mesh, ids, box, axis, side, cells);
    return mesh;
}

TriMesh make_tube(std::span<const Vec3> points, std::span<const double> radii, int sides) {
    assert(points.size() >= 2 && points.size() == radii.size() && sides >= 3);
    const std::vector<Frame> frames = carry_frames(points);
    const int cap_rings = std::max(1, sides / 4);
    TriMesh mesh;
    mesh.vertices.push_back(points.front() - radii.front() * frames.front().ahead);
    std::vector<Index> rings;
    const auto ring = [&](const Vec3& at, const Frame& f, double radius) {
        rings.push_back(static_cast<Index>(mesh.vertices.size()));
        add_ring(mesh, at, f.u, f.v, radius, sides);
    };
    for (int k = 1; k < cap_rings; ++k) {
        const double angle = 0.5 * kPi * k / cap_rings;
        ring(points.front() - radii.front() * std::cos(angle) * frames.front().ahead, frames.front(), radii.front() * std::sin(angle));
    }
    for (std::size_t i = 0; i < points.size(); ++i) ring(points[i], frames[i], radii[i]);
    for (int k = 1; k < cap_rings; ++k) {
        const double angle = 0.5 * kPi * k / cap_rings;
        ring(points.back() + radii.back() * std::sin(angle) * frames.back().ahead, frames.back(), radii.back() * std::cos(angle));
    }
    const auto tip = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.push_back(points.back() + radii.back() * frames.back().ahead);
    for (std::size_t k = 0; k + 1 < rings.size(); ++k) add_band(mesh, rings[k], rings[k + 1], sides);
    for (int k = 0; k < sides; ++k) {
        const auto a = static_cast<Index>(k), b = static_cast<Index>((k + 1) % sides);
        mesh.triangles.push_back({0, rings.front() + b, rings.front() + a});
        mesh.triangles.push_back({tip, rings.back() + a, rings.back() + b});
    }
    return mesh;
}

TriMesh make_capsule(const Vec3& from, const Vec3& to, double radius, int sides) {
    const double ring_distance = 2 * kPi * radius / sides;
    const int pieces = std::max(1, static_cast<int>(std::lround((to - from).norm() / ring_distance)));
    std::vector<Vec3> points;
    for (int k = 0; k <= pieces; ++k) points.push_back(from + (to - from) * (static_cast<double>(k) / pieces));
    const std::vector<double> radii(points.size(), radius);
    return make_tube(points, radii, sides);
}

TriMesh make_torus(const Vec3& centre, double ring_radius, double tube_radius, int rings, int sides) {
    assert(rings >= 3 && sides >= 3);
    TriMesh mesh;
    for (int k = 0; k < rings; ++k) {
        const double angle = 2 * kPi * k / rings;
        const Vec3 out(std::cos(angle), std::sin(angle), 0);
        add_ring(mesh, centre + ring_radius * out, Vec3::UnitZ(), out, tube_radius, sides); // z x out points ahead
    }
    for (int k = 0; k < rings; ++k) add_band(mesh, static_cast<Index>(k * sides), static_cast<Index>(((k + 1) % rings) * sides), sides);
    return mesh;
}

} // namespace trocar::anatomy
