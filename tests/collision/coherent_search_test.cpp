// Skipping frames against ContactSearch, step by step: the same contacts with the same bits, for every motion.
#include "tests/collision/allocations.hpp"
#include "tests/collision/sequences.hpp"

#include <gtest/gtest.h>

namespace trocar::collision {
namespace {

using testing::build;
using testing::compare;
using testing::make_catheter;
using testing::make_rolling_sheet;
using testing::make_sheet;
using testing::make_soup;
using testing::options_at;
using testing::MeshSequence;
using testing::Totals;

TEST(CoherentSearch, FindsTheContactsOfEveryStepOfClothAndCatheter) {
    for (const double distance : {0.0, 0.004}) {
        SCOPED_TRACE(distance);
        const Totals sheet = compare(make_rolling_sheet(24), options_at(distance));
        EXPECT_GT(sheet.contacts, 200u);
        EXPECT_LT(3 * sheet.tests, 2 * sheet.tests_anew);
        EXPECT_LT(sheet.sessions, 20u);
        for (const bool merged : {false, true}) {
            const Totals catheter = compare(make_catheter(24, merged), options_at(distance));
            EXPECT_GT(catheter.contacts, 200u);
            EXPECT_LT(catheter.tests, catheter.tests_anew / 2);
        }
    }
}

TEST(CoherentSearch, FindsTheContactsOfASoup) {
    for (const double motion : {0.001, 0.01, 0.1})
        for (const double distance : {0.0, 0.01}) {
            SCOPED_TRACE(::testing::Message() << "motion " << motion << " distance " << distance);
            EXPECT_GT(compare(make_soup(3, 400, 10, motion), options_at(distance)).contacts, motion < 0.01 ? 20u : 200u);
        }
}

TEST(CoherentSearch, NoExactSwitchChangesAContact) {
    const MeshSequence sheet = make_rolling_sheet(12), catheter = make_catheter(12, true), soup = make_soup(4, 80, 8, 0.02);
    const auto with = [](auto change) {
        CoherentOptions options = options_at(0.002);
        change(options);
        return options;
    };
    const std::vector<std::pair<const char*, CoherentOptions>> all{
        {"without skipping", with([](auto& o) { o.skipping = false; })},
        {"not along the clusters' normals", with([](auto& o) { o.sides = false; })},
        {"falls back", with([](auto& o) { o.falls_back = true; })},
        {"no front end", with([](auto& o) { o.front_end = false; })},
        {"the paper's inflation", with([](auto& o) { o.inflation = VolumeInflation::Paper; })},
        {"the paper's inflation, slack speed", with([](auto& o) {
             o.inflation = VolumeInflation::Paper;
             o.speed_slack = 0.001;
         })},
        {"alone", with([](auto& o) {
             o.dangling = DanglingTraversal::Alone;
             o.slack = 0.05;
             o.session_length = 6;
         })},
        {"partial", with([](auto& o) {
             o.dangling = DanglingTraversal::Partial;
             o.slack = 0.05;
             o.session_length = 6;
         })},
        {"length 1", with([](auto& o) { o.session_length = 1; })},
        {"length 64", with([](auto& o) { o.session_length = 64; })},
        {"no slack", with([](auto& o) { o.slack = 0.0; })},
        {"no reach", with([](auto& o) { o.reach = 0.0; })},
        {"wide reach", with([](auto& o) { o.reach = 4.0; })},
        {"one triangle in a cluster, two children", with([](auto& o) {
             o.tree.cluster_size = 1;
             o.tree.arity = 2;
         })},
        {"arity 4, without SIMD", with([](auto& o) {
             o.tree.arity = 4;
             o.tree.cluster_size = 32;
             o.simd = false;
         })},
        {"between only", with([](auto& o) { o.within = false; })},
        {"within only", with([](auto& o) { o.between = false; })},
    };
    for (const auto& [name, options] : all) {
        SCOPED_TRACE(name);
        for (const MeshSequence* q : {&sheet, &catheter, &soup}) static_cast<void>(compare(*q, options));
    }
}
/// The heuristic may lose contacts, and only that; on a sheet that is rolled up it finds those of its layers.
TEST(CoherentSearch, NormalConesInventNoContact) {
    const MeshSequence q = make_rolling_sheet(16);
    CoherentOptions options = options_at(0.0);
    CoherentSearch exact, heuristic;
    build(exact, q, options);
    options.normal_cones = true;
    build(heuristic, q, options);
    std::vector<SearchContact> all, some;
    std::size_t found = 0, kept = 0;
    std::uint64_t pairs = 0, pairs_left = 0;
    for (std::size_t k = 0; k < q.step_count(); ++k) {
        for (auto* search : {&exact, &heuristic}) {
            ASSERT_TRUE(search->start_step(q.step(k)).ok());
            search->find_candidates();
            search->decide(search == &exact ? all : some);
        }
        ASSERT_TRUE(std::includes(all.begin(), all.end(), some.begin(), some.end(), comes_before));
        found += all.size();
        kept += some.size();
        pairs += exact.coherence().kept_clusters;
        pairs_left += heuristic.coherence().kept_clusters;
    }
    std::printf("%zu contacts of %zu\n", kept, found);
    EXPECT_GT(2 * kept, found);
    EXPECT_LT(4 * pairs_left, 3 * pairs);
}

TEST(CoherentSearch, AsksForNoMemoryOnceItHasSeenTheMotion) {
    MeshSequence q = make_catheter(12, false);
    for (std::size_t round = 0; round < 8; ++round) // over and over
        for (std::size_t k = 0; k < 12; ++k) q.starts.push_back(k);
    CoherentOptions options = options_at(0.002);
    options.session_length = 4; // the same sessions in every round
    CoherentSearch search;
    build(search, q, options);
    std::vector<SearchContact> found;
    std::vector<std::vector<SurfaceMotion>> motions;
    for (std::size_t k = 0; k < q.step_count(); ++k) motions.push_back(q.step(k));
    std::size_t before = 0;
    for (std::size_t k = 0; k < q.step_count(); ++k) {
        if (k == 72) before = testing::allocation_count();
        ASSERT_TRUE(search.start_step(motions[k]).ok());
        search.find_candidates();
        search.decide(found);
    }
    EXPECT_EQ(testing::allocation_count() - before, 0u);
}

/// Two sheets that lie on each other and slide: drifts bring their clusters nearer in every step, but not across the plane between them.
TEST(CoherentSearch, LayersThatSlideStayOnTheirSides) {
    MeshSequence q;
    q.surfaces = {make_sheet(48, 24, 0.02), make_sheet(48, 24, 0.02)};
    for (std::size_t k = 0; k <= 12; ++k)
        q.add_frame([&](std::size_t s, const Vec3& p, std::size_t) {
            const double height = 0.004 * std::sin(9.0 * p[0] + 7.0 * p[1]) + (s == 0 ? 0.0 : 0.012);
            const Vec3 at = p + Vec3(s == 0 ? 0.0 : 0.015 * static_cast<double>(k), 0.0, height);
            return Vec3(at[0], 0.6 * at[1] - 0.8 * at[2], 0.8 * at[1] + 0.6 * at[2]); // aslant: boxes overlap
        });
    CoherentOptions with = options_at(0.001), without = with;
    without.sides = false;
    const Totals seen = compare(q, with), blind = compare(q, without);
    std::printf("clusters on their sides %llu times; elementary tests %llu, without %llu, anew %llu; work %.0f, without %.0f\n",
                static_cast<unsigned long long>(seen.sides), static_cast<unsigned long long>(seen.tests),
                static_cast<unsigned long long>(blind.tests), static_cast<unsigned long long>(seen.tests_anew), seen.work, blind.work);
    EXPECT_GT(seen.sides, 100u);
    EXPECT_EQ(blind.sides, 0u);
    EXPECT_LT(2 * seen.tests, blind.tests);
    EXPECT_LT(seen.work, blind.work);
}

} // namespace
} // namespace trocar::collision
