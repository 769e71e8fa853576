// Planes of faces between clusters: what they prove apart the elementary tests never report, and no contact changes.
#include "collision/search/face_planes.hpp"

#include "collision/ccd/sweep_batch.hpp"
#include "collision/search/contact_search.hpp"
#include "collision/search/interruptible_search.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::Surface;

/// Faces of a surface in blocks of 16, as DopTree lays them out.
std::vector<Index> corners_of(const Surface& s) {
    const std::size_t blocks = (s.triangles.size() + 15) / 16;
    std::vector<Index> corners(blocks * 48, 0);
    for (std::size_t t = 0; t < s.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) corners[t / 16 * 48 + k * 16 + t % 16] = s.triangles[t][k];
    return corners;
}

bool keeps_off(const Surface& hull, const Surface& s, double distance) {
    std::vector<Index> vertices(hull.t0.size());
    std::iota(vertices.begin(), vertices.end(), Index{0});
    const auto corners = corners_of(s);
    return hull_keeps_off(hull.motion(), vertices, s.motion(), {corners.data(), static_cast<Index>(s.triangles.size())}, distance);
}

/// Does an elementary test report anything between them?
bool meets(const Surface& a, const Surface& b, const SweepLimits& limits) {
    std::vector<FeaturePair> vf, fv, ee;
    for (Index v = 0; v < a.t0.size(); ++v)
        for (Index f = 0; f < b.triangles.size(); ++f) vf.push_back({v, f});
    for (Index v = 0; v < b.t0.size(); ++v)
        for (Index f = 0; f < a.triangles.size(); ++f) fv.push_back({v, f});
    for (Index e = 0; e < a.topology.edges.size(); ++e)
        for (Index f = 0; f < b.topology.edges.size(); ++f) ee.push_back({e, f});
    std::vector<Sweep> sweeps(std::max({vf.size(), fv.size(), ee.size()}));
    bool hit = false;
    const auto look = [&](std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) hit = hit || sweeps[i].hit();
    };
    sweep_vertex_faces(a.motion(), b.motion(), vf, limits, sweeps);
    look(vf.size());
    sweep_vertex_faces(b.motion(), a.motion(), fv, limits, sweeps);
    look(fv.size());
    sweep_edge_edges(a.motion(), b.motion(), ee, limits, sweeps);
    look(ee.size());
    return hit;
}

void move(Surface& s, const Vec3& by) {
    for (auto* points : {&s.t0, &s.t1})
        for (Vec3& p : *points) p += by;
}

TEST(FacePlanes, ProveNothingApartThatTheElementaryTestsReport) {
    Random random(41);
    std::size_t apart = 0, met = 0;
    for (int round = 0; round < 4000; ++round) {
        Surface a = testing::make_triangle_soup(random, 1 + round % 5, 0.2, 0.3, round % 3 == 0 ? 0.0 : 0.2);
        Surface b = testing::make_triangle_soup(random, 1 + round % 7, 0.2, 0.3, 0.2);
        move(a, random.vector(0.8));
        const double scale = round % 4 == 0 ? 1e-9 : round % 4 == 1 ? 1e6 : 1.0, offset = round % 5 == 0 ? 1e4 : 0.0;
        for (Surface* s : {&a, &b})
            for (auto* points : {&s->t0, &s->t1})
                for (Vec3& p : *points) p = scale * (p + Vec3::Constant(offset));
        const SweepLimits limits{.distance = round % 2 == 0 ? 0.0 : 0.05 * scale, .tolerance = 0.005 * scale};
        const bool off = keeps_off(a, b, limits.distance + limits.tolerance), hit = meets(a, b, limits);
        ASSERT_FALSE(off && hit) << "seed 41, round " << round;
        apart += off;
        met += hit;
    }
    EXPECT_GT(apart, 500u);
    EXPECT_GT(met, 500u);
}

/// A gap that is found or not by less than a micrometre: the bound is close to the truth.
TEST(FacePlanes, TellAGapFromNoneWithinAMillionth) {
    Surface plate, needle;
    plate.t0 = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    plate.t1 = {{0, 0, 0.5}, {1, 0, 0.5}, {0, 1, 0.5}}; // rises
    plate.triangles = {{0, 1, 2}};
    needle.t0 = {{0.3, 0.3, 0.2}, {0.3, 0.3, 2.0}, {0.4, 0.3, 2.0}};
    needle.t1 = needle.t0;
    for (Vec3& p : needle.t1) p[2] += 0.4; // rises less: 0.2 at first, 0.1 at last
    needle.triangles = {{0, 1, 2}};
    plate.close();
    needle.close();
    EXPECT_TRUE(keeps_off(needle, plate, 0.1 - 1e-6));
    EXPECT_FALSE(keeps_off(needle, plate, 0.1 + 1e-6));
    for (Vec3& p : needle.t0) p[2] = 0.7 - p[2]; // through the plate in the middle of the step
    EXPECT_FALSE(keeps_off(needle, plate, 0.0));
}

TEST(FacePlanes, ProveNothingOfWhatIsNotANumberOrHasNoSize) {
    Random random(42);
    const Surface far = testing::make_triangle_soup(random, 3, 0.1, 0.1, 0.0);
    Surface near = testing::make_triangle_soup(random, 3, 0.1, 0.1, 0.0);
    move(near, Vec3(5.0, 0.0, 0.0));
    ASSERT_TRUE(keeps_off(near, far, 0.01) && keeps_off(far, near, 0.01));
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300})
        for (const bool at_end : {false, true}) {
            Surface broken = near;
            (at_end ? broken.t1 : broken.t0)[4][1] = bad;
            EXPECT_FALSE(keeps_off(broken, far, 0.01)) << bad;
            EXPECT_FALSE(keeps_off(far, broken, 0.01)) << bad;
        }
    EXPECT_FALSE(keeps_off(near, far, std::numeric_limits<double>::infinity()));
    Surface point = near; // all corners in one place: the line to the centre is left
    for (auto* points : {&point.t0, &point.t1}) points->assign(points->size(), Vec3(3.0, 0.0, 0.0));
    EXPECT_TRUE(keeps_off(far, point, 0.01));
    for (auto* points : {&point.t0, &point.t1}) points->assign(points->size(), far.t0[0]);
    EXPECT_FALSE(keeps_off(far, point, 0.0));
}

struct Found {
    std::vector<Contact> contacts;
    ExactStats stats;
};

Found find(const Surface& a, const Surface& b, double distance, bool planes) {
    DopTree tree_a, tree_b;
    const TreeOptions options{.cluster_size = 16, .fine = true};
    tree_a.build(a.topology, a.t0, options);
    tree_b.build(b.topology, b.t0, options);
    tree_a.refit(a.motion());
    tree_b.refit(b.motion());
    InterruptibleSearch search;
    WorkBudget budget;
    Found found;
    found.stats = search.find({Thing::body(0), &tree_a, a.motion()}, {Thing::body(1), &tree_b, b.motion()},
                              {.distance = distance, .tolerance = 0.1 * distance, .planes = planes}, budget, found.contacts);
    return found;
}

std::uint64_t count_tests(const ExactStats& s) { return s.candidates_vf + s.candidates_ee; }

/// A catheter in its vessel, pushed along it. aside   m, from the middle: 0.03 brings it to the wall
std::pair<Surface, Surface> make_skin_and_wall(double aside) {
    std::pair<Surface, Surface> both{testing::make_bent_tube(0.9, 0.02, 400, 16, 1.5), testing::make_bent_tube(1.0, 0.05, 160, 40, 1.5)};
    move(both.first, Vec3(aside, 0.0, 0.0));
    for (Vec3& p : both.first.t1) p += Vec3(0.0004, 0.0002, 0.003);
    return both;
}

TEST(FacePlanes, TellMostPairsOfClustersApartWhereNothingTouches) {
    const auto [skin, wall] = make_skin_and_wall(0.029);
    DopTree trees[2];
    for (const bool is_wall : {false, true}) {
        const Surface& s = is_wall ? wall : skin;
        trees[is_wall].build(s.topology, s.t0, {.cluster_size = 16, .fine = true});
        trees[is_wall].refit(s.motion());
    }
    const SurfacePair pair({Thing::body(0), &trees[0], skin.motion()}, {Thing::body(1), &trees[1], wall.motion()}, {.distance = 1e-5, .tolerance = 1e-6});
    ClusterTraversal traversal;
    traversal.start(pair);
    std::vector<ClusterPair> pairs;
    while (traversal.advance(pair, 100, pairs)) {
    }
    const auto apart = std::count_if(pairs.begin(), pairs.end(), [&](ClusterPair at) { return pair.clusters_are_apart(at); });
    std::printf("%td of %zu pairs of clusters\n", apart, pairs.size());
    EXPECT_GT(pairs.size(), 100u);
    EXPECT_GT(2 * static_cast<std::size_t>(apart), pairs.size());
    EXPECT_TRUE(find(skin, wall, 1e-5, true).contacts.empty());
}

TEST(FacePlanes, ChangeNoContactOfACatheterInItsVessel) {
    for (const double distance : {0.0, 2e-4, 3e-3}) {
        SCOPED_TRACE(distance);
        const auto [skin, wall] = make_skin_and_wall(0.0298); // some of it a hair outside
        const Found with = find(skin, wall, distance, true), without = find(skin, wall, distance, false);
        EXPECT_GT(without.contacts.size(), 10u);
        ASSERT_EQ(with.contacts.size(), without.contacts.size());
        for (std::size_t i = 0; i < with.contacts.size(); ++i) {
            const Contact &x = with.contacts[i], &y = without.contacts[i];
            EXPECT_TRUE(std::equal(std::begin(x.feature_a), std::end(x.feature_a), std::begin(y.feature_a)));
            EXPECT_TRUE(std::equal(std::begin(x.feature_b), std::end(x.feature_b), std::begin(y.feature_b)));
            EXPECT_EQ(x.time, y.time);
            EXPECT_EQ(x.normal, y.normal);
            EXPECT_EQ(x.gap, y.gap);
        }
        EXPECT_EQ(with.stats.safe_fraction, without.stats.safe_fraction);
        EXPECT_EQ(with.stats.cluster_pairs, without.stats.cluster_pairs);
        EXPECT_LT(count_tests(with.stats), count_tests(without.stats));
    }
}

TEST(FacePlanes, ChangeNoContactWithinASurface) {
    Random random(43);
    const Surface s = testing::make_triangle_soup(random, 400, 1.0, 0.15, 0.1);
    const SurfaceTopology* surfaces[] = {&s.topology};
    const std::span<const Vec3> positions[] = {s.t0};
    const SurfaceMotion motions[] = {s.motion()};
    std::vector<SearchContact> found[2];
    for (const bool planes : {false, true}) {
        SearchOptions options;
        options.planes = planes;
        options.tree = {.cluster_size = 4, .fine = true};
        ContactSearch search;
        search.build(surfaces, positions, options);
        search.refit(motions);
        search.find_candidates();
        search.decide(found[planes]);
    }
    EXPECT_GT(found[0].size(), 100u);
    ASSERT_EQ(found[0].size(), found[1].size());
    for (std::size_t i = 0; i < found[0].size(); ++i) {
        EXPECT_EQ(found[0][i].id_a, found[1][i].id_a);
        EXPECT_EQ(found[0][i].id_b, found[1][i].id_b);
        EXPECT_EQ(found[0][i].contact.time, found[1][i].contact.time);
    }
}

} // namespace
} // namespace trocar::collision
