// Welding against a plain map, and on positions that were made to fall into one slot of its hash table.
#include "engine/io/weld.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>

namespace trocar::engine {
namespace {

std::size_t weld_by_map(TriMesh& mesh) {
    std::map<std::array<double, 3>, Index> ids; // -0 equals 0 here too
    std::vector<Vec3> kept;
    std::vector<Index> map;
    for (const Vec3& p : mesh.vertices) {
        const auto [found, is_new] = ids.try_emplace({p.x(), p.y(), p.z()}, static_cast<Index>(kept.size()));
        if (is_new) kept.push_back(p);
        map.push_back(found->second);
    }
    const std::size_t joined = mesh.vertices.size() - kept.size();
    mesh.vertices = kept;
    for (Triangle& triangle : mesh.triangles)
        for (Index& v : triangle) v = map[v];
    return joined;
}

void expect_as_by_map(TriMesh mesh, const char* of) {
    TriMesh plain = mesh;
    const std::size_t wanted = weld_by_map(plain);
    EXPECT_EQ(weld_equal_vertices(mesh), wanted) << of;
    EXPECT_EQ(mesh.vertices, plain.vertices) << of;
    EXPECT_EQ(mesh.triangles, plain.triangles) << of;
}

TriMesh fan_of(std::vector<Vec3> vertices) {
    TriMesh mesh;
    for (Index v = 0; v + 2 < vertices.size(); ++v) mesh.triangles.push_back({v, v + 1, v + 2});
    mesh.vertices = std::move(vertices);
    return mesh;
}

TEST(Weld, JoinsWhatAMapJoins) {
    constexpr unsigned kSeed = 20261122;
    SCOPED_TRACE(kSeed);
    std::mt19937 random(kSeed);
    for (const int sides : {1, 3, 30}) {
        std::uniform_int_distribution<int> side(-sides, sides);
        std::vector<Vec3> vertices;
        for (int k = 0; k < 5000; ++k) vertices.emplace_back(0.1 * side(random), -0.0 * side(random), 1e300 * side(random));
        expect_as_by_map(fan_of(vertices), "positions on a grid");
    }
    expect_as_by_map({}, "nothing");
}

/// z so that the hash of (0, 0, z) ends in 32 bits of 0: each round of it can be undone.
double find_colliding(std::uint64_t k) {
    constexpr std::uint64_t kStart = 0x9E3779B97F4A7C15u, kFactor = 0xFF51AFD7ED558CCDu;
    std::uint64_t inverse = kFactor; // modulo 2^64, by Newton's steps
    for (int step = 0; step < 6; ++step) inverse *= 2 - kFactor * inverse;
    std::uint64_t before_z = kStart;
    for (int axis = 0; axis < 2; ++axis) before_z *= kFactor, before_z ^= before_z >> 32;
    std::uint64_t code = k << 32;
    code ^= code >> 32;
    return std::bit_cast<double>((code * inverse) ^ before_z);
}

/// Two million of them, one after the other along one chain of slots, would be 2e12 probes: the test's time limit would catch it.
TEST(Weld, OfPositionsThatAllCollideIsNoSlower) {
    std::vector<Vec3> vertices;
    for (std::uint64_t k = 1; vertices.size() < 2'000'000; ++k)
        if (const double z = find_colliding(k); std::isfinite(z) && std::abs(z) > 1e-300 && std::abs(z) < 1e300)
            vertices.emplace_back(0, 0, z);
    for (std::size_t k = 0; k < 1000; ++k) vertices.push_back(vertices[1000 * k]);
    expect_as_by_map(fan_of(std::move(vertices)), "positions that collide");
}

} // namespace
} // namespace trocar::engine
