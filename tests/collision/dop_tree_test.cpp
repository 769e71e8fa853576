// A tree that follows a surface finds what one finds that is refitted to every motion.
#include "collision/bvh/dop_tree.hpp"
#include "collision/proximity/proximity.hpp"
#include "collision/search/interruptible_search.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trocar::collision {
namespace {

using namespace testing;

double longest_way(const Surface& surface) {
    double longest = 0.0;
    for (std::size_t v = 0; v < surface.t0.size(); ++v) longest = std::max(longest, (surface.t1[v] - surface.t0[v]).norm());
    return longest * (1.0 + 0x1p-40);
}

std::vector<Index> find_close(DopTree& tree, const Surface& surface, const Vec3& point, double radius) {
    std::vector<Index> ids;
    for_each_close_triangle(tree, surface.motion(), point, radius, [&](Index id, const PointOnTriangle&) { ids.push_back(id); });
    return ids;
}

constexpr TreeOptions kKinds[] = {{}, {.cluster_size = 4}, {.dop = 14, .arity = 4}, {.dop = 6, .cluster_size = 16, .fine = true}};

/// Random motions, of all vertices and of all together; searches here and there, in some steps none.
TEST(DopTree, ThatFollowsFindsTheTrianglesOfOneThatIsRefitted) {
    for (const unsigned seed : {41u, 42u, 43u})
        for (const TreeOptions& options : kKinds) {
            Random random(seed);
            Surface surface = make_bent_tube(0.2, 0.01, 60, 16, 4.0);
            surface.t1 = surface.t0;
            surface.close();
            DopTree follows, whole;
            for (DopTree* tree : {&follows, &whole}) {
                tree->build(surface.topology, surface.t0, options);
                tree->refit(surface.motion());
            }
            std::size_t found = 0;
            for (int round = 0; round < 40; ++round) {
                surface.t0 = surface.t1;
                const Vec3 together = round % 7 == 6 ? Vec3(Vec3::Zero()) : random.vector(3e-3);
                const double apart = round % 7 == 6 ? 0.0 : 5e-4; // in some steps nothing moves
                for (Vec3& v : surface.t1) v += together + random.vector(apart);
                whole.refit(surface.motion());
                follows.follow(surface.motion(), longest_way(surface));
                for (int search = round % 4 == 3 ? 0 : 6; search > 0; --search) {
                    const Vec3 at = surface.t1[random.bits() % surface.t1.size()] + random.vector(5e-3);
                    const std::vector<Index> here = find_close(follows, surface, at, 4e-3);
                    ASSERT_EQ(here, find_close(whole, surface, at, 4e-3)) << "seed " << seed << ", round " << round;
                    found += here.size();
                }
            }
            EXPECT_GT(found, 500u);
        }
}

/// Of random trees, places and numbers: what a search with a radius that shrinks to the k-th nearest finds is what all triangles say.
TEST(DopTree, ASearchWhoseRadiusShrinksFindsTheNearest) {
    for (const TreeOptions& options : kKinds) {
        Random random(44);
        Surface surface = make_bent_tube(0.2, 0.01, 60, 16, 4.0);
        surface.t1 = surface.t0;
        surface.close();
        DopTree tree;
        tree.build(surface.topology, surface.t0, options);
        tree.refit(surface.motion());
        std::size_t asked = 0, seen = 0;
        for (int round = 0; round < 300; ++round) {
            if (round % 50 == 49) {
                surface.t0 = surface.t1;
                const Vec3 together = random.vector(3e-3);
                for (Vec3& v : surface.t1) v += together + random.vector(5e-4);
                tree.follow(surface.motion(), longest_way(surface));
            }
            const Vec3 at = surface.t1[random.bits() % surface.t1.size()] + random.vector(2e-2);
            const double farthest = random.real(0.0, 0.04);
            const std::size_t most = random.bits() % 40 + 1;
            std::vector<double> all, found; // m^2, ascending
            for (const Triangle& t : surface.topology.triangles) {
                const double distance_sq = closest_on_triangle(at, surface.t1[t[0]], surface.t1[t[1]], surface.t1[t[2]]).distance_sq;
                if (distance_sq <= farthest * farthest) all.push_back(distance_sq);
            }
            asked += all.size();
            std::ranges::sort(all);
            for_each_close_triangle(tree, surface.motion(), at, farthest, [&](Index, const PointOnTriangle& on) {
                ++seen;
                found.insert(std::ranges::upper_bound(found, on.distance_sq), on.distance_sq);
                if (found.size() > most) found.pop_back();
                return found.size() < most ? farthest : std::sqrt(found.back());
            });
            all.resize(std::min(most, all.size()));
            ASSERT_EQ(found, all) << "round " << round << ", " << most << " within " << farthest;
        }
        EXPECT_LT(seen, asked / 2) << "most of what is within reach was not looked at";
    }
}

/// Moves of less than half a unit in the last place of the way so far, a million of them: each is another motion all the same.
TEST(DopTree, ThatFollowsMovesThatAreLostInTheWaySoFarStillFindsWhatIsThere) {
    constexpr double kMove = 5e-14, kRadius = 1e-3; // m
    constexpr int kMoves = 1'000'000;
    for (const TreeOptions& options : kKinds) {
        Surface surface = make_bent_tube(0.2, 0.01, 60, 16, 4.0);
        surface.t1 = surface.t0;
        surface.close();
        DopTree follows, whole;
        for (DopTree* tree : {&follows, &whole}) {
            tree->build(surface.topology, surface.t0, options);
            tree->refit(surface.motion());
        }
        const Vec3 beside = surface.t0[30 * 16] + (kRadius + 0.8 * kMoves * kMove) * Vec3::UnitX(); // of the vertex farthest out
        follows.follow(surface.motion(), 1e3);
        EXPECT_TRUE(find_close(follows, surface, beside, kRadius).empty());
        for (int move = 1; move < kMoves; ++move) follows.follow(surface.motion(), kMove);
        for (std::vector<Vec3>* at : {&surface.t0, &surface.t1})
            for (Vec3& v : *at) v.x() += kMoves * kMove;
        follows.follow(surface.motion(), kMove);
        whole.refit(surface.motion());
        const std::vector<Index> found = find_close(whole, surface, beside, kRadius);
        EXPECT_FALSE(found.empty());
        EXPECT_EQ(find_close(follows, surface, beside, kRadius), found);
    }
}

/// The same of a search between two surfaces: candidates and contacts, in their order.
TEST(DopTree, ThatFollowsGivesTheContactsOfOneThatIsRefitted) {
    for (const unsigned seed : {51u, 52u})
        for (const TreeOptions& options : kKinds) {
            Random random(seed);
            Surface wall = make_bent_tube(0.2, 0.01, 60, 16, 4.0), rod = make_bent_tube(0.15, 0.008, 50, 8, 4.0);
            for (Surface* one : {&wall, &rod}) one->t1 = one->t0, one->close();
            DopTree follows, whole, of_rod;
            for (DopTree* tree : {&follows, &whole}) {
                tree->build(wall.topology, wall.t0, options);
                tree->refit(wall.motion());
            }
            of_rod.build(rod.topology, rod.t0, options);
            InterruptibleSearch search;
            std::uint64_t hits = 0;
            for (int round = 0; round < 24; ++round) {
                for (Surface* one : {&wall, &rod}) {
                    one->t0 = one->t1;
                    const Vec3 together = random.vector(1e-3);
                    for (Vec3& v : one->t1) v += together + random.vector(2e-4);
                }
                whole.refit(wall.motion());
                of_rod.refit(rod.motion());
                follows.follow(wall.motion(), longest_way(wall));
                if (round % 4 == 3) continue;
                std::vector<Contact> of_follows, of_whole;
                ExactStats stats[2];
                for (const bool refitted : {false, true}) {
                    WorkBudget budget;
                    stats[refitted] = search.find({Thing::body(0), &of_rod, rod.motion()}, {Thing::body(1), refitted ? &whole : &follows, wall.motion()},
                                                  {.distance = round % 2 == 0 ? 0.0 : 1e-4, .tolerance = 1e-6}, budget, refitted ? of_whole : of_follows);
                }
                ASSERT_EQ(of_follows.size(), of_whole.size()) << "seed " << seed << ", round " << round;
                for (std::size_t k = 0; k < of_whole.size(); ++k) {
                    ASSERT_EQ(of_follows[k].feature_a[0], of_whole[k].feature_a[0]);
                    ASSERT_EQ(of_follows[k].feature_b[0], of_whole[k].feature_b[0]);
                    ASSERT_EQ(of_follows[k].time, of_whole[k].time);
                }
                ASSERT_EQ(stats[0].cluster_pairs, stats[1].cluster_pairs);
                ASSERT_EQ(stats[0].candidates_vf, stats[1].candidates_vf);
                ASSERT_EQ(stats[0].candidates_ee, stats[1].candidates_ee);
                hits += of_whole.size();
            }
            EXPECT_GT(hits, 100u);
        }
}

} // namespace
} // namespace trocar::collision
