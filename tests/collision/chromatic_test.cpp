#include "collision/culling/chromatic_sets.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace trocar::collision {
namespace {

using testing::Random;

struct Mesh {
    std::vector<Triangle> triangles;
    std::size_t vertex_count = 0;
};

Mesh make_grid(Index columns, Index rows, bool shuffled_diagonals) {
    Mesh mesh{{}, (columns + 1) * (rows + 1)};
    for (Index y = 0; y < rows; ++y)
        for (Index x = 0; x < columns; ++x) {
            const Index a = y * (columns + 1) + x, b = a + 1, c = a + columns + 1, d = c + 1;
            if (shuffled_diagonals && (x * 7 + y * 3) % 5 < 2) {
                mesh.triangles.push_back({a, b, d});
                mesh.triangles.push_back({d, c, a});
            } else {
                mesh.triangles.push_back({a, b, c});
                mesh.triangles.push_back({b, d, c});
            }
        }
    return mesh;
}

Mesh make_random(Random& random, std::size_t triangles, std::size_t vertices) {
    Mesh mesh{{}, vertices};
    for (std::size_t i = 0; i < triangles; ++i) {
        Triangle t;
        for (Index& v : t) v = static_cast<Index>(random.bits() % vertices);
        mesh.triangles.push_back(t); // degenerate, duplicate and non-manifold ones among them
    }
    return mesh;
}

/// Both guarantees, checked on every pair of triangles, independent of vertex stars.
void expect_guarantees_by_brute_force(const ChromaticSets& sets, const Mesh& mesh) {
    for (Index t = 0; t < mesh.triangles.size(); ++t) {
        std::vector<Index> neighbours(sets.count(), 0);
        for (Index other = 0; other < mesh.triangles.size(); ++other)
            if (other != t && are_adjacent(mesh.triangles[t], mesh.triangles[other])) ++neighbours[sets.set_of[other]];
        ASSERT_EQ(neighbours[sets.set_of[t]], 0u) << "triangle " << t << " touches another of its set";
        ASSERT_LE(*std::max_element(neighbours.begin(), neighbours.end()), 1u) << "triangle " << t << " has two neighbours in one set";
    }
}

void expect_guarantees(const ChromaticSets& sets, const Mesh& mesh) {
    const SetViolations found = check_sets(sets, mesh.triangles, TriangleStars(mesh.triangles, mesh.vertex_count));
    EXPECT_EQ(found.adjacent_in_set, 0u);
    EXPECT_EQ(found.second_neighbours, 0u);
    ASSERT_EQ(sets.members.size(), mesh.triangles.size());
    for (Index s = 0; s < sets.count(); ++s) {
        EXPECT_FALSE(sets.set(s).empty());
        for (const Index t : sets.set(s)) ASSERT_EQ(sets.set_of[t], s);
    }
}

TEST(ChromaticSets, BothGuaranteesHoldOnRandomMeshes) {
    Random random(71);
    for (int round = 0; round < 60; ++round) {
        SCOPED_TRACE(::testing::Message() << "seed 71, round " << round);
        const Mesh mesh = make_random(random, 1 + random.bits() % 250, 3 + random.bits() % 400);
        const ChromaticSets sets = make_chromatic_sets(mesh.triangles, mesh.vertex_count);
        expect_guarantees(sets, mesh);
        expect_guarantees_by_brute_force(sets, mesh);
    }
}

TEST(ChromaticSets, AGuaranteeThatIsBrokenIsSeen) {
    const Mesh mesh = make_grid(9, 9, false);
    const TriangleStars stars(mesh.triangles, mesh.vertex_count);
    ChromaticSets sets = make_sets_by_dsatur(mesh.triangles, mesh.vertex_count);
    sets.set_of[20] = sets.set_of[21]; // halves of one quad
    EXPECT_GT(check_sets(sets, mesh.triangles, stars).adjacent_in_set, 0u);
    EXPECT_GT(check_sets(sets, mesh.triangles, stars).second_neighbours, 0u);
}

TEST(ChromaticSets, FansOfAnySizeKeepTheGuarantees) {
    for (const Index blades : {3u, 8u, 60u, 255u, 256u, 257u, 700u, 50000u}) {
        SCOPED_TRACE(blades);
        Mesh mesh{{}, 3 * static_cast<std::size_t>(blades) + 1};
        for (Index k = 0; k < blades; ++k) { // a closed fan with a collar of triangles on its rim
            const Index next = (k + 1) % blades;
            mesh.triangles.push_back({0, 1 + k, 1 + next});
            mesh.triangles.push_back({1 + k, 1 + next, 1 + blades + k});
            mesh.triangles.push_back({1 + blades + k, 1 + blades + next, 1 + next});
        }
        const ChromaticSets sets = make_chromatic_sets(mesh.triangles, mesh.vertex_count);
        EXPECT_GE(sets.count(), blades);
        if (blades <= 700) expect_guarantees(sets, mesh); // the search costs the square of the valence
        if (blades <= 256) expect_guarantees_by_brute_force(sets, mesh);
    }
}

TEST(ChromaticSets, ManyTrianglesOverFewVerticesAreNoTrap) {
    Random random(5);
    const Mesh mesh = make_random(random, 30000, 300);
    const ChromaticSets sets = make_chromatic_sets(mesh.triangles, mesh.vertex_count);
    EXPECT_EQ(sets.members.size(), mesh.triangles.size());
    EXPECT_GT(sets.count(), 300u); // a vertex of valence 300 alone needs as many
}

TEST(ChromaticSets, DuplicatesAndDegenerateTrianglesAreSetApart) {
    const Mesh mesh{{{0, 1, 2}, {0, 1, 2}, {2, 1, 0}, {3, 3, 4}, {4, 4, 4}, {5, 6, 7}}, 8};
    const ChromaticSets sets = make_chromatic_sets(mesh.triangles, mesh.vertex_count);
    expect_guarantees_by_brute_force(sets, mesh);
    EXPECT_EQ(sets.count(), 3u);
}

TEST(ChromaticSets, NothingGivesNoSets) {
    EXPECT_EQ(make_chromatic_sets({}, 0).count(), 0u);
    EXPECT_EQ(make_chromatic_sets({}, 12).count(), 0u);
}

TEST(ChromaticSets, AQuadGridTakesEighteenSetsInLinearTime) {
    for (const bool shuffled : {false, true}) {
        const Mesh mesh = make_grid(23, 17, shuffled);
        ASSERT_TRUE(find_quad_grid(mesh.triangles, mesh.vertex_count).has_value());
        const ChromaticSets sets = make_chromatic_sets(mesh.triangles, mesh.vertex_count);
        EXPECT_TRUE(sets.from_grid);
        EXPECT_EQ(sets.count(), 18u);
        expect_guarantees_by_brute_force(sets, mesh);
    }
}

TEST(ChromaticSets, WhatIsNoGridIsNotTakenForOne) {
    Mesh mesh = make_grid(6, 6, false);
    EXPECT_TRUE(find_quad_grid(std::span(mesh.triangles).first(20), mesh.vertex_count).has_value()); // a part of one still is
    std::swap(mesh.triangles[0], mesh.triangles[5]);
    EXPECT_FALSE(find_quad_grid(mesh.triangles, mesh.vertex_count).has_value());
    mesh = make_grid(6, 6, false);
    mesh.triangles.push_back(mesh.triangles[0]); // a quad twice
    mesh.triangles.push_back(mesh.triangles[1]);
    EXPECT_FALSE(find_quad_grid(mesh.triangles, mesh.vertex_count).has_value());
    Mesh tube = make_grid(6, 6, false); // closed by a last column: its vertices are no longer one apart
    tube.triangles.push_back({6, 0, 13});
    tube.triangles.push_back({0, 7, 13});
    EXPECT_FALSE(find_quad_grid(tube.triangles, tube.vertex_count).has_value());
    const Mesh one_row_wrapped{{{1, 2, 3}, {2, 4, 3}}, 5}; // rows of two: 1 and 2 are not in one row
    EXPECT_FALSE(find_quad_grid(one_row_wrapped.triangles, 5).has_value());
}

TEST(ChromaticSets, TheSameMeshGetsTheSameSets) {
    const auto surface = testing::make_bent_tube(1.0, 0.1, 40, 16, 0.0);
    const ChromaticSets a = make_chromatic_sets(surface.triangles, surface.t0.size());
    const ChromaticSets b = make_chromatic_sets(surface.triangles, surface.t0.size());
    EXPECT_EQ(a.set_of, b.set_of);
    EXPECT_LE(a.count(), 22u);
}

TEST(ChromaticSets, SlotsHoldEveryTriangleOnceAndOnlyNeighboursShareOne) {
    Random random(17);
    for (int round = 0; round < 10; ++round) {
        const Mesh mesh = round % 2 == 0 ? make_random(random, 120, 200) : make_grid(7, 8, true);
        const TriangleStars stars(mesh.triangles, mesh.vertex_count);
        const ChromaticSets sets = make_chromatic_sets(mesh.triangles, mesh.vertex_count);
        for (Index i = 0; i < std::min<Index>(sets.count(), 12); ++i)
            for (Index j = 0; j < std::min<Index>(sets.count(), 12); ++j) {
                std::vector<Index> of_i, of_j;
                for (const SetSlot& slot : pair_sets(sets, mesh.triangles, stars, i, j)) {
                    if (slot.of_i != kNoIndex) of_i.push_back(slot.of_i);
                    if (slot.of_j != kNoIndex) of_j.push_back(slot.of_j);
                    if (slot.of_i != kNoIndex && slot.of_j != kNoIndex) {
                        ASSERT_TRUE(are_adjacent(mesh.triangles[slot.of_i], mesh.triangles[slot.of_j]));
                    }
                    if (slot.of_i == kNoIndex || slot.of_j != kNoIndex) continue;
                    for (const Index q : sets.set(j)) ASSERT_FALSE(are_adjacent(mesh.triangles[slot.of_i], mesh.triangles[q]));
                }
                std::sort(of_i.begin(), of_i.end());
                std::sort(of_j.begin(), of_j.end());
                ASSERT_TRUE(std::ranges::equal(of_i, sets.set(i)));
                ASSERT_TRUE(std::ranges::equal(of_j, sets.set(j)));
            }
    }
}

} // namespace
} // namespace trocar::collision
