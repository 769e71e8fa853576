#include "collision/culling/chromatic_culler.hpp"
#include "collision/culling/cull_twin.hpp"
#include "collision/search/interruptible_search.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::Surface;
using Hit = std::tuple<int, Index, Index>; // 0 vertex of a and face of b, 1 the other way, 2 edges

bool holds(const Triangle& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }

/// The hits among these pairs, each at most once (a second time fails the test).
void add_hits(int kind, const SurfaceMotion& a, const SurfaceMotion& b, const std::vector<FeaturePair>& pairs, const SweepLimits& limits,
              std::set<Hit>& hits) {
    std::vector<Sweep> sweeps(pairs.size());
    if (kind == 2) {
        sweep_edge_edges(a, b, pairs, limits, sweeps);
    } else {
        sweep_vertex_faces(a, b, pairs, limits, sweeps);
    }
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (sweeps[i].hit() && !hits.insert({kind, pairs[i].a, pairs[i].b}).second)
            ADD_FAILURE() << "kind " << kind << ": " << pairs[i].a << ", " << pairs[i].b << " came twice";
}

std::set<Hit> find_self_hits_by_brute_force(const Surface& s, const SweepLimits& limits) {
    std::vector<FeaturePair> vf, ee;
    for (Index v = 0; v < s.t0.size(); ++v)
        for (Index f = 0; f < s.triangles.size(); ++f)
            if (s.topology.vertex_owner[v] != kNoIndex && !holds(s.triangles[f], v)) vf.push_back({v, f});
    const auto& edges = s.topology.edges;
    for (Index e = 0; e < edges.size(); ++e)
        for (Index f = e + 1; f < edges.size(); ++f)
            if (edges[e][0] != edges[f][0] && edges[e][0] != edges[f][1] && edges[e][1] != edges[f][0] && edges[e][1] != edges[f][1])
                ee.push_back({e, f});
    std::set<Hit> hits;
    add_hits(0, s.motion(), s.motion(), vf, limits, hits);
    add_hits(2, s.motion(), s.motion(), ee, limits, hits);
    return hits;
}

std::set<Hit> find_hits_by_brute_force(const Surface& a, const Surface& b, const SweepLimits& limits) {
    std::vector<FeaturePair> vf, fv, ee;
    for (Index v = 0; v < a.t0.size(); ++v)
        for (Index f = 0; f < b.triangles.size(); ++f) vf.push_back({v, f});
    for (Index v = 0; v < b.t0.size(); ++v)
        for (Index f = 0; f < a.triangles.size(); ++f) fv.push_back({v, f});
    for (Index e = 0; e < a.topology.edges.size(); ++e)
        for (Index f = 0; f < b.topology.edges.size(); ++f) ee.push_back({e, f});
    std::set<Hit> hits;
    add_hits(0, a.motion(), b.motion(), vf, limits, hits);
    add_hits(1, b.motion(), a.motion(), fv, limits, hits);
    add_hits(2, a.motion(), b.motion(), ee, limits, hits);
    return hits;
}

struct Answer {
    std::set<Hit> hits;
    CullCounts counts;
};

bool look(ChromaticCuller& culler, const CullPlan& plan) {
    CpuCullBackend twin;
    return culler.look(plan, twin).ok();
}
bool look(ChromaticCuller& culler, const QueryPlan& plan) {
    CpuCanvas canvas;
    return culler.look(plan, canvas).ok();
}
constexpr const CullPlan* kWithoutStageTwo = nullptr;

/// plan   none: stages I, III and IV alone
template <class Plan>
Answer find_self_hits(const Surface& s, const SweepLimits& limits, const Plan* plan) {
    BoxTree tree;
    tree.build(s.topology, s.t0);
    tree.refit(s.motion());
    ChromaticCuller culler(s.topology);
    culler.find_near(s.motion(), tree, s.motion(), tree, limits.distance, limits.tolerance);
    EXPECT_TRUE(plan == nullptr || look(culler, *plan));
    CulledCandidates found;
    culler.find_candidates(found);
    Answer answer{{}, culler.counts()};
    add_hits(0, s.motion(), s.motion(), found.vertex_face, limits, answer.hits);
    add_hits(2, s.motion(), s.motion(), found.edge_edge, limits, answer.hits);
    EXPECT_TRUE(found.face_vertex.empty());
    return answer;
}

template <class Plan>
Answer find_hits(const Surface& a, const Surface& b, const SweepLimits& limits, const Plan* plan) {
    BoxTree tree_a, tree_b;
    tree_a.build(a.topology, a.t0);
    tree_b.build(b.topology, b.t0);
    tree_a.refit(a.motion());
    tree_b.refit(b.motion());
    ChromaticCuller culler(a.topology, b.topology);
    culler.find_near(a.motion(), tree_a, b.motion(), tree_b, limits.distance, limits.tolerance);
    EXPECT_TRUE(plan == nullptr || look(culler, *plan));
    CulledCandidates found;
    culler.find_candidates(found);
    Answer answer{{}, culler.counts()};
    add_hits(0, a.motion(), b.motion(), found.vertex_face, limits, answer.hits);
    add_hits(1, b.motion(), a.motion(), found.face_vertex, limits, answer.hits);
    add_hits(2, a.motion(), b.motion(), found.edge_edge, limits, answer.hits);
    return answer;
}

const std::vector<CullPlan> kPlans = {
    {.memory = CullMemory::Intervals, .resolution = 128},
    {.memory = CullMemory::Fronts, .resolution = 128},
    {.memory = CullMemory::Fronts, .resolution = 64, .reversed_views = true},
    {.memory = CullMemory::Intervals, .resolution = 1},
    {.memory = CullMemory::Intervals, .resolution = 7, .max_rounds = 6, .worthwhile = 0.0},
    {.memory = CullMemory::Intervals, .resolution = 700, .max_rounds = 1},
    {.memory = CullMemory::Intervals, .resolution = 40, .max_rounds = 1, .adapt_resolution = false},
};

const std::vector<QueryPlan> kQueryPlans = {
    {.resolution = 96},
    {.resolution = 48, .views = 6, .axis_tests = false},
    {.resolution = 33, .adapt_resolution = false, .max_rounds = 1, .view_coherence = false},
};

void expect_the_same_hits(const Surface& s, const SweepLimits& limits, std::size_t at_least = 1) {
    const std::set<Hit> truth = find_self_hits_by_brute_force(s, limits);
    EXPECT_GE(truth.size(), at_least);
    EXPECT_EQ(find_self_hits(s, limits, kWithoutStageTwo).hits, truth) << "without stage II";
    for (std::size_t k = 0; k < kPlans.size(); ++k) EXPECT_EQ(find_self_hits(s, limits, &kPlans[k]).hits, truth) << "plan " << k;
    for (std::size_t k = 0; k < kQueryPlans.size(); ++k)
        EXPECT_EQ(find_self_hits(s, limits, &kQueryPlans[k]).hits, truth) << "queries, plan " << k;
}

/// A sheet folded over itself, wrinkled: every fold comes near the one below.
Surface make_folded_sheet(Index columns, Index rows, double gap, Random& random) {
    Surface s;
    const Index half = columns / 4;
    for (Index y = 0; y <= rows; ++y)
        for (Index x = 0; x <= columns; ++x) {
            const Index layer = x / half, along = x % half;
            const double place = layer % 2 == 0 ? along : half - along;
            s.t0.push_back(Vec3(place, y, gap * layer) + random.vector(0.05));
            s.t1.push_back(s.t0.back() + Vec3(0.1, 0.05, layer % 2 == 0 ? 0.6 * gap : -0.6 * gap) + random.vector(0.1));
        }
    for (Index y = 0; y < rows; ++y)
        for (Index x = 0; x < columns; ++x) {
            const Index a = y * (columns + 1) + x, b = a + 1, c = a + columns + 1, d = c + 1;
            s.triangles.push_back({a, b, c});
            s.triangles.push_back({b, d, c});
        }
    s.close();
    return s;
}

TEST(ChromaticCuller, FindsEveryContactOfTriangleSoups) {
    Random random(3);
    for (int round = 0; round < 8; ++round) {
        SCOPED_TRACE(::testing::Message() << "seed 3, round " << round);
        expect_the_same_hits(testing::make_triangle_soup(random, 60, 1.0, 0.3, round % 2 == 0 ? 0.3 : 0.0),
                             {.distance = round % 3 == 0 ? 0.05 : 0.0}, 0);
    }
}

TEST(ChromaticCuller, FindsEveryContactOfFoldedCloth) {
    Random random(4);
    for (const double distance : {0.0, 0.02, 0.3}) {
        SCOPED_TRACE(distance);
        expect_the_same_hits(make_folded_sheet(24, 8, 0.4, random), {.distance = distance, .tolerance = 0.01}, 20);
    }
}

TEST(ChromaticCuller, FindsEveryContactOfMeshesWithoutManners) {
    // few vertices and many triangles: fans, duplicates, degenerate ones, edges of ten triangles; adjacent triangles meet as well
    Random random(5);
    for (int round = 0; round < 8; ++round) {
        SCOPED_TRACE(::testing::Message() << "seed 5, round " << round);
        Surface s;
        const std::size_t vertices = 8 + random.bits() % 60;
        for (std::size_t v = 0; v < vertices; ++v) {
            s.t0.push_back(random.vector(1.0));
            s.t1.push_back(s.t0.back() + random.vector(0.4));
        }
        for (std::size_t t = 0; t < 70; ++t) {
            Triangle triangle;
            for (Index& v : triangle) v = static_cast<Index>(random.bits() % vertices);
            s.triangles.push_back(triangle);
        }
        s.close();
        expect_the_same_hits(s, {.distance = 0.01});
    }
}

TEST(ChromaticCuller, AFanTooLargeForAListIsSearchedEachStep) {
    Random random(6);
    Surface s;
    s.t0.push_back(Vec3::Zero());
    constexpr Index kBlades = 150;
    for (Index k = 0; k < kBlades; ++k) s.t0.push_back(Vec3(std::cos(0.042 * k), std::sin(0.042 * k), 0.0) + random.vector(0.2));
    for (Index k = 0; k < kBlades; ++k) s.triangles.push_back({0, 1 + k, 1 + (k + 1) % kBlades});
    s.t1 = s.t0;
    for (Vec3& p : s.t1) p += random.vector(0.2);
    s.close();
    expect_the_same_hits(s, {}, 50);
}

TEST(ChromaticCuller, TwoTrianglesAndLessAreEnough) {
    Random random(7);
    for (const std::size_t count : {0u, 1u, 2u}) {
        const Surface s = testing::make_triangle_soup(random, count, 0.05, 1.0, 0.5);
        expect_the_same_hits(s, {.distance = 0.1}, 0);
    }
    Surface joined; // two triangles at one vertex, folded onto each other: only stage IV can find it
    joined.t0 = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0.1, 0.3}, {0.1, 1, 0.3}};
    joined.t1 = joined.t0;
    joined.t1[3] -= Vec3(0, 0, 0.6);
    joined.triangles = {{0, 1, 2}, {0, 3, 4}};
    joined.close();
    expect_the_same_hits(joined, {}, 1);
}

TEST(ChromaticCuller, WhatIsNotANumberStays) {
    Random random(8);
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
        Surface s = testing::make_triangle_soup(random, 30, 1.0, 0.3, 0.2);
        s.t1[11][1] = bad;
        s.close();
        expect_the_same_hits(s, {.distance = 0.01}, 80);
    }
}

TEST(ChromaticCuller, FarFromTheOriginAndTinyAndHugeMeshesKeepTheirContacts) {
    for (const double scale : {1e-9, 1.0, 1e9})
        for (const double offset : {0.0, 1e7}) {
            SCOPED_TRACE(::testing::Message() << "scale " << scale << ", offset " << offset);
            Random random(9);
            Surface s = testing::make_triangle_soup(random, 50, 1.0, 0.4, 0.3);
            for (auto* points : {&s.t0, &s.t1})
                for (Vec3& p : *points) p = scale * (p + Vec3::Constant(offset));
            s.close();
            expect_the_same_hits(s, {.distance = 0.02 * scale});
        }
}

TEST(ChromaticCuller, TwoBodiesKeepTheirContacts) {
    Random random(10);
    for (int round = 0; round < 6; ++round) {
        SCOPED_TRACE(::testing::Message() << "seed 10, round " << round);
        const Surface a = testing::make_triangle_soup(random, 40, 1.0, 0.4, 0.2),
                      b = testing::make_triangle_soup(random, 50, 1.0, 0.3, 0.2);
        const SweepLimits limits{.distance = round % 2 == 0 ? 0.0 : 0.05};
        const auto truth = find_hits_by_brute_force(a, b, limits);
        EXPECT_GT(truth.size(), 10u);
        EXPECT_EQ(find_hits(a, b, limits, kWithoutStageTwo).hits, truth);
        for (const CullPlan& plan : kPlans) EXPECT_EQ(find_hits(a, b, limits, &plan).hits, truth);
        for (const QueryPlan& plan : kQueryPlans) EXPECT_EQ(find_hits(a, b, limits, &plan).hits, truth);
    }
}

/// A catheter through a bent vessel, so tight that the wall is near on all sides, and not touched.
std::pair<Surface, Surface> make_catheter_in_vessel() {
    std::pair<Surface, Surface> bodies{testing::make_bent_tube(1.0, 0.02, 100, 12, 1.5), testing::make_bent_tube(1.0, 0.04, 80, 24, 1.5)};
    for (Vec3& p : bodies.first.t0) p += Vec3(0.005, 0.0, 0.0);
    bodies.first.t1 = bodies.first.t0;
    for (Vec3& p : bodies.first.t1) p += Vec3(0.005, 0.0, 0.001);
    return bodies;
}

TEST(ChromaticCuller, InsideAVesselEveryMemoryKeepsTheContacts) {
    const auto [catheter, vessel] = make_catheter_in_vessel();
    const CullPlan plans[] = {{.memory = CullMemory::Fronts, .resolution = 512},
                              {.memory = CullMemory::Fronts, .resolution = 512, .reversed_views = true},
                              {.memory = CullMemory::Intervals, .resolution = 512}};
    const SweepLimits limits{.distance = 0.002};
    const auto plain = find_hits(catheter, vessel, limits, kWithoutStageTwo);
    for (const CullPlan& plan : plans) {
        const Answer answer = find_hits(catheter, vessel, limits, &plan);
        EXPECT_EQ(answer.hits, plain.hits);
        EXPECT_LT(answer.counts.left_pairs, plain.counts.near_pairs / 2);
        std::printf("catheter in its vessel, %s: %zu pairs of %zu left\n",
                    plan.memory == CullMemory::Intervals ? "intervals"
                    : plan.reversed_views                ? "fronts, reversed views too"
                                                         : "fronts",
                    answer.counts.left_pairs, plain.counts.near_pairs);
    }
    for (const int views : {3, 6}) {
        const QueryPlan plan{.resolution = 512, .views = views};
        const Answer answer = find_hits(catheter, vessel, limits, &plan);
        EXPECT_EQ(answer.hits, plain.hits);
        std::printf("catheter in its vessel, queries in %d views: %zu pairs of %zu left after %llu queries\n", views,
                    answer.counts.left_pairs, plain.counts.near_pairs, static_cast<unsigned long long>(answer.counts.queries.queries));
    }
}

TEST(CpuReference, OnlyIntervalsSeparateWhatLiesBetweenTwoWalls) {
    std::vector<SweptCorners> prisms;
    for (const double z : {0.0, 1.0, 2.0}) {
        const Vec3 a(0, 0, z), b(1, 0, z), c(0, 1, z);
        prisms.push_back({a, b, c, a, b, c});
    }
    const std::vector<Triangle> corners = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
    const std::vector<Index> set_begin = {0, 1, 3}, members = {1, 0, 2}; // the middle one; the two walls
    const std::vector<CullQuestion> questions = {{1, 1}};
    const std::vector<std::size_t> question_begin = {0, 0, 1};
    const CullFrame frame = make_cull_frame(view_along_axis(2, false), prisms, 0.01, 64, 64);
    std::vector<Footprint> footprints;
    for (const SweptCorners& prism : prisms) footprints.push_back(make_footprint(frame, prism));
    CullJob job{.width = 64,
                .height = 64,
                .footprints = footprints,
                .corners = corners,
                .set_begin = set_begin,
                .set_members = members,
                .questions = questions,
                .question_begin = question_begin};
    CpuCullBackend twin;
    std::uint8_t hit = 7;
    job.memory = CullMemory::Fronts;
    ASSERT_TRUE(twin.find_hits(job, std::span(&hit, 1)).ok());
    EXPECT_EQ(hit, 1);
    job.memory = CullMemory::Intervals;
    ASSERT_TRUE(twin.find_hits(job, std::span(&hit, 1)).ok());
    EXPECT_EQ(hit, 0);
}

TEST(ChromaticCuller, FoldedClothLosesPairsInStageTwo) {
    Random random(12);
    const Surface cloth = make_folded_sheet(60, 20, 0.9, random);
    const SweepLimits limits{.distance = 0.01};
    const Answer plain = find_self_hits(cloth, limits, kWithoutStageTwo);
    for (const CullMemory memory : {CullMemory::Fronts, CullMemory::Intervals}) {
        const CullPlan plan{.memory = memory, .resolution = 512};
        const Answer culled = find_self_hits(cloth, limits, &plan);
        EXPECT_EQ(culled.hits, plain.hits);
        EXPECT_LT(culled.counts.left_pairs, plain.counts.near_pairs);
        std::printf("folded cloth, %s: %zu pairs of %zu left, %zu triangles of %zu, %d views\n",
                    memory == CullMemory::Fronts ? "fronts" : "intervals", culled.counts.left_pairs, plain.counts.near_pairs,
                    culled.counts.left_triangles, plain.counts.near_triangles, culled.counts.pictures.views);
    }
}

TEST(ChromaticCuller, TheHierarchyFindsTheSame) {
    Random random(13);
    const Surface cloth = make_folded_sheet(40, 20, 0.5, random);
    const SweepLimits limits{.distance = 0.02};
    DopTree tree;
    tree.build(cloth.topology, cloth.t0, {});
    tree.refit(cloth.motion());
    WorkBudget budget;
    std::vector<Contact> contacts;
    const SearchSide side{Thing(), &tree, cloth.motion()};
    const ExactStats stats = InterruptibleSearch().find(side, side, {.distance = limits.distance}, budget, contacts);
    const CullPlan plan{.resolution = 256};
    const Answer answer = find_self_hits(cloth, limits, &plan);
    std::size_t vf = 0;
    for (const Hit& hit : answer.hits) vf += std::get<0>(hit) == 0;
    EXPECT_EQ(vf, stats.hits_vf);
    EXPECT_EQ(answer.hits.size() - vf, stats.hits_ee);
}

} // namespace
} // namespace trocar::collision
