// Surfaces as scans have them, made by the tests themselves: what is true of an organ, an animal, arteries or cloth from a scanner is asked
// of these as well, so that a machine without the test data tests the same laws. Another seed is another patient. Lengths in m.
#pragma once

#include "assets/anatomy/random.hpp"
#include "assets/anatomy/shapes.hpp"
#include "assets/anatomy/vessels.hpp"
#include "base/mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace trocar::made {

using anatomy::Random;

inline TriMesh join(TriMesh a, const TriMesh& b) {
    const auto first = static_cast<Index>(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    return a;
}

/// A bumpy, flattened ball with a hollow, about 20 cm long: closed, outward, and every ray from its middle leaves it once.
inline TriMesh make_organ(std::uint64_t seed, int subdivisions) {
    Random random(seed);
    TriMesh mesh = anatomy::make_icosphere(Vec3::Zero(), 1.0, subdivisions);
    struct Wave {
        Vec3 direction;
        double phase;
    };
    std::vector<Wave> waves;
    for (int k = 0; k < 6; ++k) {
        const Vec3 direction = (3.0 + k) * random.cube();
        waves.push_back({direction, random.uniform(0.0, 6.0)});
    }
    const Vec3 size(random.uniform(0.08, 0.1), random.uniform(0.05, 0.07), random.uniform(0.06, 0.08));
    const Vec3 hollow = Vec3(random.uniform(-0.3, 0.3), -1.0, 0.2).normalized();
    for (Vec3& v : mesh.vertices) {
        double bump = 1.0 - 0.35 * std::exp(-4.0 * (v - hollow).squaredNorm());
        for (const Wave& wave : waves) bump += 0.025 * std::sin(wave.direction.dot(v) + wave.phase);
        v = bump * size.cwiseProduct(v);
    }
    return mesh;
}

/// Branches that melt into one another, 30 cm long from 6 to 2 mm: one closed piece.
inline TriMesh make_artery_tree(std::uint64_t seed, std::size_t triangles) {
    Random random(seed);
    const auto near = [&](double x, double y, double z) { return Vec3(Vec3(x, y, z) + 0.006 * random.cube()); };
    const Vec3 fork = near(0, 0, 0.12), second = near(0.05, 0.01, 0.2);
    const std::vector<anatomy::VesselBranch> branches{
        {{near(0, 0, 0), near(0.01, 0, 0.06), fork, near(-0.02, 0.01, 0.2), near(-0.05, 0.02, 0.26)}, {6e-3, 6e-3, 5.5e-3, 5e-3, 4e-3}},
        {{fork, near(0.025, 0, 0.16), second, near(0.09, 0, 0.24)}, {4.5e-3, 4e-3, 3.5e-3, 3e-3}},
        {{second, near(0.05, 0.03, 0.24), near(0.06, 0.06, 0.27)}, {3e-3, 2.5e-3, 2e-3}}};
    auto mesh = anatomy::make_vessels(branches, 2e-3, triangles);
    EXPECT_TRUE(mesh.ok()) << mesh.error().to_string();
    return mesh.ok() ? std::move(*mesh) : TriMesh{};
}

/// An animal of capsules that melt into one another: a body with four legs, a head, ears and a tail, 20 cm long.
inline TriMesh make_animal(std::uint64_t seed, std::size_t triangles) {
    Random random(seed);
    const auto near = [&](double x, double y, double z) { return Vec3(Vec3(x, y, z) + 0.004 * random.cube()); };
    const Vec3 front = near(0.06, 0, 0.08), back = near(-0.06, 0, 0.08), head = near(0.1, 0, 0.12);
    std::vector<anatomy::VesselBranch> parts{{{back, near(0, 0, 0.085), front}, {0.03, 0.032, 0.028}}, {{front, head}, {0.02, 0.024}}};
    for (const double side : {-1.0, 1.0}) {
        parts.push_back({{front, near(0.06, 0.02 * side, 0.05), near(0.065, 0.022 * side, 0.01)}, {0.012, 0.011, 0.009}});
        parts.push_back({{back, near(-0.06, 0.02 * side, 0.05), near(-0.065, 0.022 * side, 0.01)}, {0.014, 0.012, 0.009}});
        parts.push_back({{head, near(0.1, 0.02 * side, 0.15), near(0.095, 0.025 * side, 0.175)}, {0.01, 0.008, 0.006}});
    }
    parts.push_back({{back, near(-0.1, 0, 0.1), near(-0.12, 0, 0.12)}, {0.008, 0.006, 0.005}});
    auto mesh = anatomy::make_vessels(parts, 4e-3, triangles);
    EXPECT_TRUE(mesh.ok()) << mesh.error().to_string();
    return mesh.ok() ? std::move(*mesh) : TriMesh{};
}

/// One straight vessel of an atlas whose vessels were drawn one by one: its branches begin inside its trunk.
struct Tube {
    Vec3 from, to;
    double radius;
};
inline std::vector<Tube> make_tubes(std::uint64_t seed) {
    Random random(seed);
    const Vec3 turn = 0.05 * random.cube();
    std::vector<Tube> tubes{{Vec3::Zero(), Vec3(turn[0], turn[1], 0.2), 8e-3}};
    for (int k = 0; k < 5; ++k) {
        const Vec3 root = tubes[0].from + random.uniform(0.15, 0.85) * (tubes[0].to - tubes[0].from);
        const double angle = random.uniform(0.0, 6.28);
        const Vec3 way(0.06 * std::cos(angle), 0.06 * std::sin(angle), random.uniform(-0.02, 0.03));
        tubes.push_back({root, root + way, random.uniform(2e-3, 4e-3)});
    }
    return tubes;
}

/// All of them as one surface: a shell each, which cross.
inline TriMesh make_overlapping_arteries(std::uint64_t seed, int sides = 24) {
    TriMesh mesh;
    for (const Tube& tube : make_tubes(seed)) mesh = join(std::move(mesh), anatomy::make_capsule(tube.from, tube.to, tube.radius, sides));
    return mesh;
}

/// A square cloth of 20 cm, cells x cells squares, that lies on a ball, hangs down around it and is folded under itself: open, and it
/// crosses itself the more the larger `fold` is.
inline TriMesh make_drape(Index cells, double fold) {
    TriMesh mesh;
    constexpr double kSide = 0.2, kBall = 0.05;
    for (Index i = 0; i <= cells; ++i)
        for (Index j = 0; j <= cells; ++j) {
            const double x = kSide * (double(i) / cells - 0.5), y = kSide * (double(j) / cells - 0.5);
            const double away = std::sqrt(x * x + y * y), angle = std::min(away / kBall, 1.9);
            const double turn = std::atan2(y, x), hang = std::max(0.0, away - 1.9 * kBall);
            const double out = kBall * std::sin(angle) * (1.0 + fold * std::sin(9.0 * turn) * std::min(1.0, 4.0 * hang / kBall)) -
                               fold * hang * std::cos(5.0 * turn);
            mesh.vertices.emplace_back(out * std::cos(turn), out * std::sin(turn), kBall * std::cos(angle) - hang);
        }
    for (Index i = 0; i < cells; ++i)
        for (Index j = 0; j < cells; ++j) {
            const Index a = i * (cells + 1) + j, b = a + cells + 1, c = b + 1, d = a + 1;
            mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
        }
    return mesh;
}

/// Every triangle with corners of its own, in any order and begun at any corner: what an STL file holds.
inline TriMesh as_soup(const TriMesh& mesh, Random& random) {
    std::vector<Triangle> order = mesh.triangles;
    for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random.next() % k]);
    TriMesh soup;
    for (Triangle t : order) {
        std::rotate(t.begin(), t.begin() + random.next() % 3, t.end());
        const auto first = static_cast<Index>(soup.vertices.size());
        for (const Index v : t) soup.vertices.push_back(mesh.vertices[v]);
        soup.triangles.push_back({first, first + 1, first + 2});
    }
    return soup;
}

/// Without the triangles around `count` vertices that lie apart: as many holes.
/// rims  out, edges of all of them together; null: not asked for
inline TriMesh with_holes(TriMesh mesh, std::size_t count, Random& random, std::size_t* rims = nullptr) {
    std::vector<bool> taken(mesh.vertices.size(), false);
    std::size_t edges = 0;
    for (std::size_t tries = 0; count > 0 && tries < 1000; ++tries) {
        const auto centre = static_cast<Index>(random.next() % mesh.vertices.size());
        const auto around = [&](const Triangle& t) { return std::find(t.begin(), t.end(), centre) != t.end(); };
        std::vector<Triangle> star;
        std::copy_if(mesh.triangles.begin(), mesh.triangles.end(), std::back_inserter(star), around);
        const auto is_taken = [&](const Triangle& t) { return taken[t[0]] || taken[t[1]] || taken[t[2]]; };
        if (star.empty() || std::any_of(star.begin(), star.end(), is_taken)) continue;
        for (const Triangle& t : star)
            for (const Index v : t) taken[v] = true;
        std::erase_if(mesh.triangles, around);
        edges += star.size();
        --count;
    }
    EXPECT_EQ(count, 0u) << "so many holes do not fit";
    if (rims != nullptr) *rims = edges;
    return mesh;
}

struct Named {
    std::string name;
    TriMesh mesh;
};

/// One of every kind, of about so many triangles each (500 at least).
inline std::vector<Named> make_all(std::size_t triangles, std::uint64_t seed = 1) {
    const auto grid = static_cast<Index>(std::sqrt(0.5 * static_cast<double>(triangles)));
    const int subdivisions = static_cast<int>(std::log2(static_cast<double>(triangles) / 20.0) / 2.0);
    const int sides = std::max(5, static_cast<int>(std::sqrt(static_cast<double>(triangles) / 80.0)));
    TriMesh pair = make_organ(seed + 7, subdivisions > 1 ? subdivisions - 1 : 1);
    TriMesh other = pair;
    for (Vec3& v : other.vertices) v += Vec3(0.06, 0.013, 0.007);
    std::vector<Named> all{{"organ", make_organ(seed, subdivisions)},
                           {"arteries", make_artery_tree(seed, triangles)},
                           {"arteries that overlap", make_overlapping_arteries(seed, sides)},
                           {"animal", make_animal(seed, triangles)},
                           {"two organs in one another", join(std::move(pair), other)},
                           {"flat cloth", make_drape(grid, 0.0)},
                           {"folded cloth", make_drape(grid, 1.2)},
                           {"ring", anatomy::make_torus(Vec3::Zero(), 0.06, 0.02, static_cast<int>(grid), static_cast<int>(grid))}};
    Random random(seed);
    all.push_back({"organ with holes", with_holes(all[0].mesh, 5, random)});
    return all;
}

} // namespace trocar::made
