// Small surfaces that move, for the tests of proximities.
#pragma once

#include "collision/proximity/proximity_search.hpp"
#include "shapes.hpp"

#include <string>

namespace trocar::collision::testing {

/// Several surfaces over steps that follow each other: [frame][surface][vertex].
struct Sequence {
    std::string name;
    std::vector<SurfaceTopology> surfaces;
    std::vector<std::vector<std::vector<Vec3>>> frames;
    bool smooth = true; // its normals turn slowly along it

    [[nodiscard]] std::size_t steps() const { return frames.size() - 1; }
    [[nodiscard]] std::vector<SurfaceMotion> motions(std::size_t step) const {
        std::vector<SurfaceMotion> all;
        for (std::size_t i = 0; i < surfaces.size(); ++i) all.push_back({&surfaces[i], frames[step][i], frames[step + 1][i]});
        return all;
    }
    [[nodiscard]] Result<void> build(ProximitySearch& search, const ProximityOptions& options) const {
        std::vector<const SurfaceTopology*> topologies;
        std::vector<std::span<const Vec3>> positions;
        for (std::size_t i = 0; i < surfaces.size(); ++i) {
            topologies.push_back(&surfaces[i]);
            positions.emplace_back(frames[0][i]);
        }
        return search.build(topologies, positions, options);
    }
};

/// n x n squares, two triangles each.
inline std::vector<Triangle> sheet_triangles(Index n) {
    std::vector<Triangle> triangles;
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < n; ++i) {
            const Index a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            triangles.push_back({a, b, d});
            triangles.push_back({a, d, c});
        }
    return triangles;
}

/// A sheet of edge 1 that waves and sinks onto a body with ripples: free, touching, through it.
inline Sequence make_sinking_sheet(std::uint64_t seed, Index n, std::size_t steps) {
    Sequence s{.name = "sinking sheet", .surfaces = {}, .frames = {}};
    for (int i = 0; i < 2; ++i) s.surfaces.push_back(make_topology(sheet_triangles(n), (n + 1) * (n + 1)));
    Random random(seed);
    const double phase = random.real(0.0, 6.0);
    for (std::size_t k = 0; k <= steps; ++k) {
        const double t = static_cast<double>(k);
        std::vector<Vec3> body, sheet;
        for (Index j = 0; j <= n; ++j)
            for (Index i = 0; i <= n; ++i) {
                const double x = static_cast<double>(i) / n, y = static_cast<double>(j) / n;
                body.emplace_back(x, y, 0.05 * std::sin(9.0 * x + phase) * std::cos(7.0 * y));
                sheet.push_back(Vec3(x + 0.01 * t, y, 0.16 - 0.02 * t + 0.04 * std::sin(6.0 * x - 0.4 * t) * std::sin(5.0 * y + phase)) +
                                random.vector(0.003));
            }
        s.frames.push_back({body, sheet});
    }
    return s;
}

/// One sheet that is rolled up more and more until it passes through itself.
inline Sequence make_rolling_sheet(std::uint64_t seed, Index n, std::size_t steps) {
    Sequence s{.name = "rolling sheet", .surfaces = {}, .frames = {}};
    s.surfaces.push_back(make_topology(sheet_triangles(n), (n + 1) * (n + 1)));
    Random random(seed);
    for (std::size_t k = 0; k <= steps; ++k) {
        const double bend = 0.3 + 7.0 * static_cast<double>(k) / static_cast<double>(steps);
        std::vector<Vec3> sheet;
        for (Index j = 0; j <= n; ++j)
            for (Index i = 0; i <= n; ++i) {
                const double x = static_cast<double>(i) / n, y = static_cast<double>(j) / n;
                sheet.push_back(Vec3(std::sin(bend * x) / bend, y, (1.0 - std::cos(bend * x)) / bend) + random.vector(0.002));
            }
        s.frames.push_back({sheet});
    }
    return s;
}

/// Loose triangles of two bodies that fly about.
inline Sequence make_flying_soups(std::uint64_t seed, std::size_t triangles, double speed, std::size_t steps) {
    Sequence s{.name = "flying soups", .surfaces = {}, .frames = {}, .smooth = false};
    Random random(seed);
    std::vector<std::vector<Vec3>> at;
    for (int i = 0; i < 2; ++i) {
        const Surface soup = make_triangle_soup(random, triangles, 1.0, 0.12, 0.0);
        s.surfaces.push_back(soup.topology);
        at.push_back(soup.t0);
    }
    s.frames.push_back(at);
    for (std::size_t k = 0; k < steps; ++k) {
        for (auto& body : at)
            for (Vec3& p : body) p += random.vector(speed);
        s.frames.push_back(at);
    }
    return s;
}

[[nodiscard]] inline bool same_bits(const Proximity& x, const Proximity& y) {
    return x.surface_a == y.surface_a && x.surface_b == y.surface_b && x.face_a == y.face_a && x.face_b == y.face_b && x.found.time == y.found.time &&
           x.found.points.distance == y.found.points.distance && x.found.points.bary_a == y.found.points.bary_a &&
           x.found.points.bary_b == y.found.points.bary_b && x.kept == y.kept;
}

} // namespace trocar::collision::testing
