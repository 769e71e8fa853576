// Surfaces for the collision tests, and the random numbers they share.
#pragma once

#include "collision/topology.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

namespace trocar::collision::testing {

/// splitmix64: the same numbers everywhere.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t bits() {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return z ^ (z >> 31);
    }
    double real(double from, double to) { return from + (to - from) * (static_cast<double>(bits() >> 11) * 0x1p-53); }
    Vec3 vector(double reach) {
        const double x = real(-reach, reach), y = real(-reach, reach), z = real(-reach, reach);
        return {x, y, z};
    }

private:
    std::uint64_t state_;
};

struct Surface {
    std::vector<Vec3> t0, t1;
    std::vector<Triangle> triangles;
    SurfaceTopology topology;

    void close() { topology = make_topology(triangles, t0.size()); }
    SurfaceMotion motion() const { return {&topology, t0, t1}; }
};

/// Rings around a curve in the y-z plane that bends with the given curvature, 1/m; open at both ends.
inline Surface make_bent_tube(double length, double radius, std::size_t rings, std::size_t sides, double curvature) {
    Surface s;
    for (std::size_t i = 0; i < rings; ++i) {
        const double along = length * static_cast<double>(i) / static_cast<double>(rings - 1);
        const double turn = curvature * along;
        const Vec3 centre =
            curvature == 0.0 ? Vec3(0.0, 0.0, along) : Vec3(0.0, (1.0 - std::cos(turn)) / curvature, std::sin(turn) / curvature);
        const Vec3 across(0.0, std::cos(turn), -std::sin(turn));
        for (std::size_t k = 0; k < sides; ++k) {
            const double angle =
                2.0 * 3.14159265358979 * (static_cast<double>(k) + 0.5 * static_cast<double>(i % 2)) / static_cast<double>(sides);
            s.t0.push_back(centre + radius * (std::cos(angle) * Vec3::UnitX() + std::sin(angle) * across));
        }
    }
    for (Index i = 0; i + 1 < rings; ++i)
        for (Index k = 0; k < sides; ++k) {
            const Index n = static_cast<Index>(sides), next = (k + 1) % n;
            const Index a = i * n + k, b = i * n + next, c = a + n, d = b + n;
            s.triangles.push_back({a, b, c});
            s.triangles.push_back({b, d, c});
        }
    s.t1 = s.t0;
    s.close();
    return s;
}

/// Positions on a coarse lattice: coplanar, touching, duplicate and zero-area triangles everywhere.
inline Surface make_lattice_soup(Random& random, std::size_t vertices, std::size_t triangles) {
    Surface s;
    const auto point = [&] {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<double>(random.bits() % 4);
        return p;
    };
    for (std::size_t i = 0; i < vertices; ++i) {
        s.t0.push_back(point());
        s.t1.push_back(random.bits() % 2 == 0 ? s.t0.back() : point());
    }
    const auto any = [&] { return static_cast<Index>(random.bits() % vertices); };
    while (s.triangles.size() < triangles) s.triangles.push_back({any(), any(), any()});
    s.triangles.push_back(s.triangles.front());
    s.close();
    return s;
}

/// Loose triangles thrown into a cube of the given half edge, each vertex with its own motion.
inline Surface make_triangle_soup(Random& random, std::size_t triangles, double reach, double size, double motion) {
    Surface s;
    for (Index i = 0; i < triangles; ++i) {
        const Vec3 centre = random.vector(reach);
        for (int k = 0; k < 3; ++k) {
            s.t0.push_back(centre + random.vector(size));
            s.t1.push_back(s.t0.back() + random.vector(motion));
        }
        s.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    s.close();
    return s;
}

} // namespace trocar::collision::testing
