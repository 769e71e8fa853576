#include "engine/render/render_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {
namespace {

[[nodiscard]] Vec3 unit_or_zero(const Vec3& v) noexcept {
    const double length = v.norm();
    return length > 0.0 ? Vec3(v / length) : Vec3(Vec3::Zero());
}

[[nodiscard]] double corner_angle(const Vec3& at, const Vec3& b, const Vec3& c) noexcept {
    const Vec3 u = b - at;
    const Vec3 v = c - at;
    return std::atan2(u.cross(v).norm(), u.dot(v));
}

[[nodiscard]] bool usable(std::span<const Vec3> vertices, const Triangle& t) noexcept {
    return std::all_of(t.begin(), t.end(), [&](Index v) { return v < vertices.size() && is_finite(vertices[v]); });
}

[[nodiscard]] RenderVertex make_vertex(const Vec3& position, const Vec3& normal) noexcept {
    RenderVertex v;
    for (int axis = 0; axis < 3; ++axis) {
        v.position[axis] = static_cast<float>(position[axis]);
        v.normal[axis] = static_cast<float>(normal[axis]);
    }
    return v;
}

} // namespace

void make_render_mesh(std::span<const Vec3> vertices, std::span<const Triangle> triangles, const Vec3& origin, RenderMesh& out) {
    out.vertices.clear();
    out.indices.clear();
    std::vector<Vec3> normal(vertices.size(), Vec3::Zero());
    std::vector<Vec3> face(triangles.size(), Vec3::Zero());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const Triangle& t = triangles[i];
        if (!usable(vertices, t)) continue;
        const Vec3& a = vertices[t[0]];
        const Vec3& b = vertices[t[1]];
        const Vec3& c = vertices[t[2]];
        face[i] = unit_or_zero((b - a).cross(c - a));
        normal[t[0]] += corner_angle(a, b, c) * face[i];
        normal[t[1]] += corner_angle(b, c, a) * face[i];
        normal[t[2]] += corner_angle(c, a, b) * face[i];
    }
    out.vertices.reserve(vertices.size());
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        normal[v] = unit_or_zero(normal[v]);
        out.vertices.push_back(make_vertex(is_finite(vertices[v]) ? Vec3(vertices[v] - origin) : Vec3(Vec3::Zero()), normal[v]));
    }
    out.indices.reserve(3 * triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (!usable(vertices, triangles[i])) continue;
        for (const Index v : triangles[i]) {
            const bool crease = normal[v].dot(face[i]) < kCreaseCosine && face[i].squaredNorm() > 0.5;
            out.indices.push_back(crease ? static_cast<Index>(out.vertices.size()) : v);
            if (crease) out.vertices.push_back(make_vertex(vertices[v] - origin, face[i]));
        }
    }
}

namespace {

constexpr Index kTubeSides = 20;
constexpr int kCapRings = 5;

struct TubeBuilder {
    TriMesh mesh;
    bool open = false; // a ring to connect to exists

    // The first and last ring have one vertex: the poles of the caps.
    void add_pole(const Vec3& at) {
        mesh.vertices.push_back(at);
        if (!open) return;
        const Index base = static_cast<Index>(mesh.vertices.size()) - 1 - kTubeSides;
        for (Index s = 0; s < kTubeSides; ++s) mesh.triangles.push_back({base + s, base + (s + 1) % kTubeSides, base + kTubeSides});
    }
    void add_ring(const Vec3& centre, const Vec3& u, const Vec3& v, double radius) {
        const Index first = static_cast<Index>(mesh.vertices.size());
        for (Index s = 0; s < kTubeSides; ++s) {
            const double angle = 2.0 * std::numbers::pi * s / kTubeSides;
            mesh.vertices.push_back(centre + radius * (std::cos(angle) * u + std::sin(angle) * v));
        }
        for (Index s = 0; s < kTubeSides; ++s) {
            const Index next = (s + 1) % kTubeSides;
            if (!open) {
                mesh.triangles.push_back({first - 1, first + next, first + s});
                continue;
            }
            const Index below = first - kTubeSides;
            mesh.triangles.push_back({below + s, below + next, first + s});
            mesh.triangles.push_back({below + next, first + next, first + s});
        }
        open = true;
    }
};

} // namespace

TriMesh make_tube_mesh(std::span<const Vec3> points, std::span<const double> radius) {
    std::vector<Vec3> at;
    std::vector<double> r;
    for (std::size_t i = 0; i < points.size() && !radius.empty(); ++i) {
        if (!is_finite(points[i]) || (!at.empty() && at.back() == points[i])) continue;
        at.push_back(points[i]);
        r.push_back(radius[std::min(i, radius.size() - 1)]);
    }
    if (at.size() < 2) return {};

    TubeBuilder tube;
    Vec3 tangent = unit_or_zero(at[1] - at[0]);
    Vec3 u = unit_or_zero(tangent.cross(std::abs(tangent.z()) < 0.9 ? Vec3::UnitZ() : Vec3::UnitX()));
    tube.add_pole(at.front() - r.front() * tangent);
    for (std::size_t i = 0; i < at.size(); ++i) {
        const Vec3 before = unit_or_zero(at[i] - at[i > 0 ? i - 1 : 0]);
        const Vec3 after = unit_or_zero(at[std::min(i + 1, at.size() - 1)] - at[i]);
        const Vec3 mean = unit_or_zero(before + after);
        if (mean.squaredNorm() > 0.5) tangent = mean;
        u = unit_or_zero(u - u.dot(tangent) * tangent); // carries the frame along without twist
        if (u.squaredNorm() < 0.5) u = unit_or_zero(tangent.cross(std::abs(tangent.z()) < 0.9 ? Vec3::UnitZ() : Vec3::UnitX()));
        const Vec3 v = tangent.cross(u);
        const auto add_cap_ring = [&](double sine) { // sine: height of the ring over the end's centre, in radii
            tube.add_ring(at[i] + r[i] * sine * tangent, u, v, r[i] * std::sqrt(1.0 - sine * sine));
        };
        if (i == 0)
            for (int k = kCapRings - 1; k > 0; --k) add_cap_ring(-std::sin(0.5 * std::numbers::pi * k / kCapRings));
        tube.add_ring(at[i], u, v, r[i]);
        if (i + 1 == at.size())
            for (int k = 1; k < kCapRings; ++k) add_cap_ring(std::sin(0.5 * std::numbers::pi * k / kCapRings));
    }
    tube.add_pole(at.back() + r.back() * tangent);
    return std::move(tube.mesh);
}

} // namespace trocar::engine
