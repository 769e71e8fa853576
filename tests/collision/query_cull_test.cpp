// The two passes of Govindaraju et al. 2005 with all coherence, and hard cases of image space: what touches is never free.
#include "collision/culling/chromatic_sets.hpp"
#include "collision/culling/cull_twin.hpp"
#include "collision/culling/query_culler.hpp"
#include "hard_prisms.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace trocar::collision {
namespace {

struct Problem {
    testing::Surface surface;
    ChromaticSets sets;
    std::vector<SweptCorners> prisms;
    std::vector<TrianglePair> pairs; // all that are not adjacent

    explicit Problem(testing::Surface s) : surface(std::move(s)) {
        sets = make_chromatic_sets(surface.triangles, surface.t0.size());
        const auto &t0 = surface.t0, &t1 = surface.t1;
        for (const Triangle& t : surface.triangles) prisms.push_back({t0[t[0]], t0[t[1]], t0[t[2]], t1[t[0]], t1[t[1]], t1[t[2]]});
        for (Index a = 0; a < prisms.size(); ++a)
            for (Index b = a + 1; b < prisms.size(); ++b)
                if (!are_adjacent(surface.triangles[a], surface.triangles[b])) pairs.push_back({a, b});
    }
    [[nodiscard]] CullProblem problem() const { return {prisms, surface.triangles, sets.set_of, sets.count(), 0.002}; }
};

Problem make_tube(std::uint64_t seed) {
    testing::Random random(seed);
    testing::Surface s = testing::make_bent_tube(1.0, 0.1, 14, 8, 4.0);
    for (std::size_t v = 0; v < s.t0.size(); ++v) {
        s.t0[v] += random.vector(0.02);
        s.t1[v] = s.t0[v] + random.vector(0.02);
    }
    s.close();
    return Problem(std::move(s));
}

/// What the order-free form leaves in one view along x with everything drawn.
std::vector<TrianglePair> left_by_one_view(const Problem& p, int size) {
    const CullFrame frame = make_cull_frame(view_along_axis(0, false), p.prisms, p.problem().reach, size, size);
    std::vector<Footprint> footprints;
    for (const SweptCorners& prism : p.prisms) footprints.push_back(make_footprint(frame, prism));
    std::vector<CullQuestion> questions;
    std::vector<std::size_t> question_begin{0};
    for (Index set = 0; set < p.sets.count(); ++set) {
        for (Index prism = 0; prism < p.prisms.size(); ++prism) questions.push_back({prism, set});
        question_begin.push_back(questions.size());
    }
    std::vector<std::uint8_t> hits(questions.size());
    CpuCullBackend twin;
    EXPECT_TRUE(twin.find_hits({.width = size,
                                .height = size,
                                .footprints = footprints,
                                .corners = p.surface.triangles,
                                .set_begin = p.sets.begin,
                                .set_members = p.sets.members,
                                .questions = questions,
                                .question_begin = question_begin,
                                .memory = CullMemory::Fronts},
                               hits)
                    .ok());
    const auto hit = [&](Index prism, Index set) { return hits[set * p.prisms.size() + prism] != 0; };
    std::vector<TrianglePair> left;
    for (const TrianglePair& pair : p.pairs)
        if (hit(pair.a, p.sets.set_of[pair.b]) && hit(pair.b, p.sets.set_of[pair.a])) left.push_back(pair);
    return left;
}

TEST(QueryCuller, OneViewWithoutCoherenceLeavesThePairsOfTheOrderFreeForm) {
    for (const std::uint64_t seed : {51u, 52u, 53u}) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        const Problem p = make_tube(seed);
        QueryPlan plan{.resolution = 90,
                       .adapt_resolution = false,
                       .views = 1,
                       .max_rounds = 1,
                       .axis_tests = false,
                       .view_coherence = false,
                       .temporal_order = false};
        CpuCanvas canvas;
        QueryCuller culler;
        std::vector<TrianglePair> left = p.pairs;
        ASSERT_TRUE(culler.cull(p.problem(), plan, canvas, left).ok());
        EXPECT_EQ(left, left_by_one_view(p, 90));
        EXPECT_GT(left.size(), 100u);
        EXPECT_LT(left.size(), p.pairs.size());
        plan.temporal_order = true; // another order of slots, the same answer
        left = p.pairs;
        ASSERT_TRUE(culler.cull(p.problem(), plan, canvas, left).ok());
        left = p.pairs;
        ASSERT_TRUE(culler.cull(p.problem(), plan, canvas, left).ok());
        EXPECT_EQ(left, left_by_one_view(p, 90));
    }
}

TEST(QueryCuller, EachCoherenceSavesQueriesAndKeepsNoMore) {
    const Problem p = make_tube(54);
    struct Case {
        const char* name;
        QueryPlan plan;
        std::size_t left = 0;
        std::uint64_t queries = 0;
    };
    const QueryPlan bare{.resolution = 128, .axis_tests = false, .view_coherence = false, .temporal_order = false};
    QueryPlan axes = bare, coherent = bare, all = bare;
    axes.axis_tests = true;
    coherent.view_coherence = true;
    all.axis_tests = all.view_coherence = all.temporal_order = true;
    Case cases[] = {{"none", bare}, {"1D tests", axes}, {"view coherence", coherent}, {"all, second step", all}};
    for (Case& c : cases) {
        CpuCanvas canvas;
        QueryCuller culler;
        for (int step = 0; step < (c.plan.temporal_order ? 2 : 1); ++step) {
            std::vector<TrianglePair> left = p.pairs;
            const auto report = culler.cull(p.problem(), c.plan, canvas, left);
            ASSERT_TRUE(report.ok());
            c.left = left.size();
            c.queries = report->queries;
        }
        std::printf("%s: %zu pairs of %zu left, %llu queries\n", c.name, c.left, p.pairs.size(),
                    static_cast<unsigned long long>(c.queries));
        EXPECT_LE(c.left, cases[0].left) << c.name;
        if (&c != cases) {
            EXPECT_LT(c.queries, cases[0].queries) << c.name;
        }
    }
}

TEST(QueryCuller, TakesNothingAndTwo) {
    CpuCanvas canvas;
    QueryCuller culler;
    std::vector<TrianglePair> pairs;
    EXPECT_TRUE(culler.cull({}, {}, canvas, pairs).ok());
    const Vec3 o = Vec3::Zero();
    const SweptCorners here{o, o, o, o, o, o},
        there{Vec3(1, 1, 1), Vec3(2, 1, 1), Vec3(1, 2, 1), Vec3(1, 1, 1), Vec3(2, 1, 1), Vec3(1, 2, 1)};
    const std::vector<Triangle> corners = {{0, 1, 2}, {3, 4, 5}};
    const std::vector<Index> sets = {0, 1};
    for (const bool apart : {true, false}) {
        const std::vector<SweptCorners> prisms = {here, apart ? there : here};
        pairs = {{0, 1}};
        ASSERT_TRUE(culler.cull({prisms, corners, sets, 2, 0.1}, {}, canvas, pairs).ok());
        EXPECT_EQ(pairs.empty(), apart);
    }
}

TEST(HardPrisms, WhoTouchesIsNeverFreeInAnyViewFormOrSize) {
    for (const int size : {1, 2, 7, 64, 300})
        for (int view = 0; view < 7; ++view) {
            SCOPED_TRACE(::testing::Message() << "seed 61, size " << size << ", view " << view);
            testing::Random random(61);
            const ViewDirection direction = view < 6 ? view_along_axis(view % 3, view > 2) : view_along(Vec3(1.0, 2.0, -0.5));
            const testing::HardPrisms hard(random, direction, size, 300);
            std::vector<std::uint8_t> hits(hard.questions.size());
            CpuCullBackend twin;
            for (const CullMemory memory : {CullMemory::Fronts, CullMemory::Intervals}) {
                ASSERT_TRUE(twin.find_hits(hard.job(size, memory), hits).ok());
                EXPECT_EQ(testing::count_lost(hard, hits), 0u) << (memory == CullMemory::Fronts ? "fronts" : "intervals");
                if (size == 300) {
                    EXPECT_GT(std::count(hits.begin(), hits.end(), 0), 1000); // and others are
                }
            }
            if (size > 7) continue; // slow
            CpuCanvas canvas;
            ASSERT_TRUE(find_hits_in_two_passes(hard.job(size, CullMemory::Fronts), canvas, hits).ok());
            EXPECT_EQ(testing::count_lost(hard, hits), 0u) << "two passes";
        }
}

} // namespace
} // namespace trocar::collision
