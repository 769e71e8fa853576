// Skipping frames where its predictions fail: jumps, bodies of a point, motions that turn round, input that is refused.
#include "tests/collision/sequences.hpp"

#include <gtest/gtest.h>

namespace trocar::collision {
namespace {

using testing::build;
using testing::compare;
using testing::expect_same;
using testing::make_catheter;
using testing::make_sheet;
using testing::make_soup;
using testing::options_at;
using testing::MeshSequence;
using testing::Surface;
using testing::Totals;

TEST(CoherentSearch, StandsAStepOfTenBodySizes) {
    for (const double distance : {0.0, 0.01}) {
        MeshSequence q = make_soup(7, 60, 4, 0.01);
        const auto shoot = [&](double from, double to) {
            const auto back = q.frames.back();
            q.add_frame([&](std::size_t s, const Vec3&, std::size_t v) {
                return Vec3(back[s][v] + (s == 0 ? to - from : from - to) * Vec3(1.0, 0.3, -0.2));
            });
        };
        shoot(0.0, 20.0); // body by body through each other
        shoot(20.0, 0.0);
        shoot(0.0, 0.01);
        shoot(0.01, 20.0);
        shoot(20.0, 20.0);
        EXPECT_GT(compare(q, options_at(distance)).contacts, 100u);
    }
}

TEST(CoherentSearch, StandsFastAndStillStepsInTurn) {
    MeshSequence q = make_catheter(0, false);
    for (std::size_t k = 1; k < 16; ++k)
        q.add_frame([&](std::size_t s, const Vec3& p, std::size_t) {
            return Vec3(p +
                        (s == 1 ? Vec3(0.02 * static_cast<double>(k / 2 % 3), 0.03 * static_cast<double>(k / 2 % 2), 0.1) : Vec3::Zero()));
        });
    const Totals totals = compare(q, options_at(0.001));
    EXPECT_GT(totals.contacts, 100u);
}

TEST(CoherentSearch, FollowsBodiesThatTeleportBetweenSteps) {
    MeshSequence q = make_catheter(20, false);
    q.starts = {0, 1, 2, 15, 16, 3, 3, 3, 19, 0, 1, 8}; // the same step again, back, far ahead
    EXPECT_GT(compare(q, options_at(0.0)).contacts, 50u);
    EXPECT_GT(compare(q, options_at(0.004)).contacts, 100u);
}

/// To and fro: nothing goes on as it went. The first `still` surfaces do not.
MeshSequence make_hopping_soup(std::size_t still) {
    MeshSequence q = make_soup(9, 200, 0, 0.0);
    for (std::size_t k = 1; k < 14; ++k)
        q.add_frame([&](std::size_t s, const Vec3& p, std::size_t) {
            return s < still ? p
                             : Vec3(p + Vec3((s == 0 ? -0.3 : 0.3) * static_cast<double>(k % 2), 0.02 * static_cast<double>(s + k), 0.0));
        });
    return q;
}

TEST(CoherentSearch, BeginsAnewWhereEverythingDangles) {
    CoherentOptions options = options_at(0.0);
    options.session_length = 8;
    const Totals totals = compare(make_hopping_soup(0), options);
    EXPECT_EQ(totals.sessions, 13u);
    EXPECT_GT(totals.dangling, 100u);
    EXPECT_GT(totals.contacts, 100u);
}

TEST(CoherentSearch, CatchesUpWithWhatDangles) {
    MeshSequence q = make_hopping_soup(1);
    q.surfaces[0] = make_sheet(60, 30, 0.04); // many clusters that stay
    for (auto& frame : q.frames) {
        frame[0] = q.surfaces[0].t0;
        for (Vec3& p : frame[0]) p -= Vec3(1.2, 0.6, 0.0);
    }
    for (const DanglingTraversal way : {DanglingTraversal::Adaptive, DanglingTraversal::Alone, DanglingTraversal::Partial}) {
        CoherentOptions options = options_at(0.0);
        options.session_length = 7;
        options.dangling = way;
        const Totals totals = compare(q, options);
        EXPECT_EQ(totals.sessions, 2u);
        EXPECT_GT(totals.dangling, 100u);
        EXPECT_GT(totals.contacts, 100u);
    }
}

TEST(CoherentSearch, TakesADistanceLargerThanTheBodies) {
    const Totals totals = compare(make_soup(11, 12, 4, 0.01), options_at(30.0));
    EXPECT_EQ(totals.tests, totals.tests_anew); // all pairs, always
    EXPECT_GT(totals.contacts, 1000u);
}

TEST(CoherentSearch, TakesEmptyDegenerateAndEnormousSurfaces) {
    MeshSequence q;
    Surface empty, point, huge;
    empty.close();
    point.t0 = {Vec3(0.2, 0.2, 0.0), Vec3(0.2, 0.2, 0.0), Vec3(5.0, 5.0, 5.0)};
    point.triangles = {{0, 1, 0}, {0, 1, 1}};
    point.close();
    huge.t0 = {Vec3(-1e40, -1e40, 0.0), Vec3(1e40, -1e40, 0.0), Vec3(0.0, 1e40, 0.0)};
    huge.triangles = {{0, 1, 2}};
    huge.close();
    q.surfaces = {empty, point, huge};
    for (int k = 0; k < 5; ++k)
        q.add_frame([&](std::size_t s, const Vec3& p, std::size_t) { return s == 1 ? Vec3(p + Vec3(0.0, 0.0, 0.5 - 0.3 * k)) : p; });
    EXPECT_GT(compare(q, options_at(0.0)).contacts, 0u);
}

TEST(CoherentSearch, RefusesWhatItWasNotBuiltForAndGoesOn) {
    MeshSequence q = make_catheter(4, false);
    CoherentSearch search;
    build(search, q, options_at(0.0));
    std::vector<SearchContact> before, after;
    const auto run = [&](std::size_t k, std::vector<SearchContact>& out) {
        ASSERT_TRUE(search.start_step(q.step(k)).ok());
        search.find_candidates();
        search.decide(out);
    };
    run(0, before);
    auto motions = q.step(1);
    std::vector<Vec3> bad(motions[0].t1.begin(), motions[0].t1.end());
    bad[7][1] = std::numeric_limits<double>::quiet_NaN();
    motions[0].t1 = bad;
    const auto not_finite = search.start_step(motions);
    ASSERT_FALSE(not_finite.ok());
    EXPECT_EQ(not_finite.error().code, ErrorCode::NotFinite);
    EXPECT_NE(not_finite.error().message.find("vertex 7"), std::string::npos);
    bad[7][1] = -std::numeric_limits<double>::infinity();
    EXPECT_FALSE(search.start_step(motions).ok());
    motions = q.step(1);
    std::swap(q.surfaces[1].topology.triangles[3], q.surfaces[1].topology.triangles[4]);
    const auto swapped = search.start_step(motions);
    ASSERT_FALSE(swapped.ok());
    EXPECT_NE(swapped.error().message.find("surface 1"), std::string::npos);
    std::swap(q.surfaces[1].topology.triangles[3], q.surfaces[1].topology.triangles[4]);
    const SurfaceTopology other = q.surfaces[0].topology;
    motions[0].topology = &other;
    EXPECT_FALSE(search.start_step(motions).ok());
    EXPECT_FALSE(search.start_step(std::span(motions).first(1)).ok());
    motions = q.step(1);
    motions[1].t1 = motions[1].t1.first(5);
    EXPECT_FALSE(search.start_step(motions).ok());
    run(0, after); // as if nothing had happened
    expect_same(after, before);
    CoherentOptions dop = options_at(0.0);
    dop.tree.dop = 14;
    std::vector<const SurfaceTopology*> topologies{&q.surfaces[0].topology};
    std::vector<std::span<const Vec3>> positions{q.frames[0][0]};
    EXPECT_FALSE(CoherentSearch().build(topologies, positions, dop).ok());
}

} // namespace
} // namespace trocar::collision
