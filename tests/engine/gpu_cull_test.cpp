// Stage II on OpenGL against its twin on the CPU: the same bits in every view, the same contacts whoever culls.
#include "assets/anatomy/random.hpp"
#include "collision/chromatic_culler.hpp"
#include "collision/cull_twin.hpp"
#include "engine/gpu/describe_graphics.hpp"
#include "engine/gpu/gl_cull_backend.hpp"

#include <gmock/gmock.h>

#include <algorithm>

namespace seldinger::engine {
namespace {

using namespace collision;

constexpr ContextKind kAllKinds[] = {ContextKind::EglDevice, ContextKind::EglSurfaceless, ContextKind::OsMesa};

struct Cloth {
    std::vector<Vec3> t0, t1;
    SurfaceTopology topology;
    [[nodiscard]] SurfaceMotion motion() const { return {&topology, t0, t1}; }
};

/// A sheet in four folds.
Cloth make_cloth(Index columns, Index rows, std::uint64_t seed) {
    anatomy::Random random(seed);
    Cloth cloth;
    const Index fold = columns / 4;
    for (Index y = 0; y <= rows; ++y)
        for (Index x = 0; x <= columns; ++x) {
            const double along = (x / fold) % 2 == 0 ? x % fold : fold - x % fold;
            cloth.t0.push_back(Vec3(along, y, 0.5 * (x / fold)) + 0.1 * random.cube());
            cloth.t1.push_back(cloth.t0.back() + 0.2 * random.cube());
        }
    std::vector<Triangle> triangles;
    for (Index y = 0; y < rows; ++y)
        for (Index x = 0; x < columns; ++x) {
            const Index a = y * (columns + 1) + x, b = a + 1, c = a + columns + 1, d = c + 1;
            triangles.push_back({a, b, c});
            triangles.push_back({b, d, c});
        }
    cloth.topology = make_topology(triangles, cloth.t0.size());
    return cloth;
}

/// One view of everything: all prisms drawn, every prism asks every set.
struct WholeView {
    std::vector<Footprint> footprints;
    std::vector<Index> set_begin{0}, members;
    std::vector<CullQuestion> questions;
    std::vector<std::size_t> question_begin{0};
    CullJob job;

    WholeView(std::span<const SweptCorners> prisms, std::span<const Triangle> corners, const ChromaticSets& sets, int axis, bool reversed,
              int size) {
        const CullFrame frame = make_cull_frame(view_along_axis(axis, reversed), prisms, 0.01, size, size);
        for (const SweptCorners& prism : prisms) footprints.push_back(make_footprint(frame, prism));
        for (Index set = 0; set < sets.count(); ++set) {
            for (const Index t : sets.set(set)) members.push_back(t);
            set_begin.push_back(static_cast<Index>(members.size()));
            for (Index prism = 0; prism < prisms.size(); ++prism) questions.push_back({prism, set});
            question_begin.push_back(questions.size());
        }
        job = {.width = size,
               .height = size,
               .footprints = footprints,
               .corners = corners,
               .set_begin = set_begin,
               .set_members = members,
               .questions = questions,
               .question_begin = question_begin};
    }
};

std::vector<SweptCorners> prisms_of(const Cloth& c) {
    std::vector<SweptCorners> prisms;
    for (const Triangle& t : c.topology.triangles)
        prisms.push_back({c.t0[t[0]], c.t0[t[1]], c.t0[t[2]], c.t1[t[0]], c.t1[t[1]], c.t1[t[2]]});
    return prisms;
}

std::vector<std::unique_ptr<GlCullBackend>> all_backends() {
    std::vector<std::unique_ptr<GlCullBackend>> backends;
    for (const ContextKind kind : kAllKinds) {
        auto backend = GlCullBackend::make({.order = {kind}});
        if (backend.ok()) {
            std::printf("%s\n", (*backend)->name().c_str());
            backends.push_back(std::move(backend).value());
        } else {
            std::printf("%s is not there: %s\n", name_of(kind), backend.error().message.c_str());
        }
    }
    return backends;
}

TEST(GpuCull, EveryContextAnswersAsTheTwinDoesBitForBit) {
    const auto backends = all_backends();
    if (backends.empty()) GTEST_SKIP() << "no OpenGL 4.5 with layers on this machine";
    const Cloth cloth = make_cloth(16, 8, 1);
    const auto prisms = prisms_of(cloth);
    const ChromaticSets sets = make_chromatic_sets(cloth.topology.triangles, cloth.t0.size());
    for (const CullMemory memory : {CullMemory::Fronts, CullMemory::Intervals})
        for (int view = 0; view < 4; ++view) {
            WholeView whole(prisms, cloth.topology.triangles, sets, view % 3, view == 3, view == 1 ? 61 : 128);
            whole.job.memory = memory;
            std::vector<std::uint8_t> expected(whole.questions.size(), 7), hits(whole.questions.size(), 7);
            CpuCullBackend twin;
            ASSERT_TRUE(twin.find_hits(whole.job, expected).ok());
            EXPECT_GT(std::count(expected.begin(), expected.end(), 1), 100);
            EXPECT_GT(std::count(expected.begin(), expected.end(), 0), 100);
            for (const auto& backend : backends) {
                const auto done = backend->find_hits(whole.job, hits);
                ASSERT_TRUE(done.ok()) << done.error().message;
                EXPECT_EQ(hits, expected) << backend->name() << ", view " << view;
            }
        }
}

TEST(GpuCull, MoreSetsThanLayersFitAreDrawnInTurns) {
    auto backend = GlCullBackend::make();
    if (!backend.ok()) GTEST_SKIP() << backend.error().message;
    anatomy::Random random(2); // loose triangles, each a set of its own: 300 sets
    std::vector<SweptCorners> prisms;
    std::vector<Triangle> corners;
    ChromaticSets sets;
    sets.begin.push_back(0);
    for (Index t = 0; t < 300; ++t) {
        SweptCorners prism;
        const Vec3 centre = random.cube();
        for (Vec3& corner : prism) corner = centre + 0.1 * random.cube();
        prisms.push_back(prism);
        corners.push_back({3 * t, 3 * t + 1, 3 * t + 2});
        sets.set_of.push_back(t);
        sets.members.push_back(t);
        sets.begin.push_back(t + 1);
    }
    const WholeView whole(prisms, corners, sets, 0, false, 64);
    std::vector<std::uint8_t> expected(whole.questions.size(), 7), hits(whole.questions.size(), 7);
    CpuCullBackend twin;
    ASSERT_TRUE(twin.find_hits(whole.job, expected).ok());
    const auto done = (*backend)->find_hits(whole.job, hits);
    ASSERT_TRUE(done.ok()) << done.error().message;
    EXPECT_LT((*backend)->layers(), 300);
    EXPECT_EQ(hits, expected);
}

TEST(GpuCull, TheSamePairsAreLeftWhoeverCulls) {
    auto backend = GlCullBackend::make();
    if (!backend.ok()) GTEST_SKIP() << backend.error().message;
    const Cloth cloth = make_cloth(24, 12, 3);
    BoxTree tree;
    tree.build(cloth.topology, cloth.t0);
    tree.refit(cloth.motion());
    ChromaticCuller culler(cloth.topology);
    CpuCullBackend twin;
    const CullPlan plan{.resolution = 128};
    std::vector<TrianglePair> left[2];
    for (int k = 0; k < 2; ++k) {
        culler.find_near(cloth.motion(), tree, cloth.motion(), tree, 0.01, 0.0);
        const auto done = k == 0 ? culler.look(plan, twin) : culler.look(plan, **backend);
        ASSERT_TRUE(done.ok()) << done.error().message;
        EXPECT_LT(culler.counts().left_pairs, culler.counts().near_pairs);
        left[k].assign(culler.pairs().begin(), culler.pairs().end());
    }
    EXPECT_EQ(left[0], left[1]);
}

TEST(GpuCull, WithoutOpenGlTheReasonIsSaid) {
    const auto backend = GlCullBackend::make({.egl_library = "libNoSuchEgl.so.1", .osmesa_library = "libNoSuchMesa.so.8"});
    ASSERT_FALSE(backend.ok());
    EXPECT_THAT(backend.error().message, testing::HasSubstr("libNoSuchEgl.so.1"));
}

TEST(GpuCull, WhatThisMachineCanIsSaidInWords) {
    const auto lines = describe_graphics();
    for (const GraphicsLine& line : lines) std::printf("%s: %s\n", line.what.c_str(), line.how.c_str());
    ASSERT_GE(lines.size(), 2u);
    EXPECT_EQ(lines.back().what, "culling");
    const auto nothing = describe_graphics({.order = {}});
    ASSERT_EQ(nothing.size(), 2u);
    EXPECT_EQ(nothing[0].what, "none");
    EXPECT_THAT(nothing[1].how, testing::HasSubstr("CPU twin"));
}

TEST(GpuCull, AskingNothingIsAnsweredWithNothing) {
    auto backend = GlCullBackend::make();
    if (!backend.ok()) GTEST_SKIP() << backend.error().message;
    const std::vector<Index> set_begin = {0};
    const std::vector<std::size_t> question_begin = {0};
    const CullJob job{.width = 8,
                      .height = 8,
                      .footprints = {},
                      .corners = {},
                      .set_begin = set_begin,
                      .set_members = {},
                      .questions = {},
                      .question_begin = question_begin};
    EXPECT_TRUE((*backend)->find_hits(job, {}).ok());
}

} // namespace
} // namespace seldinger::engine
