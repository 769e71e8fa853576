// Stage II on OpenGL against the CPU reference: the same bits in every view, the same contacts with every culler.
#include "../collision/hard_prisms.hpp"
#include "collision/culling/chromatic_culler.hpp"
#include "collision/culling/cull_twin.hpp"
#include "engine/render/describe_graphics.hpp"
#include "engine/render/gl_canvas.hpp"
#include "engine/render/gl_cull_backend.hpp"
#include "gpu_fixture.hpp"

#include <gmock/gmock.h>

#include <algorithm>

namespace trocar::engine {
namespace {

// by name: other files of this program say testing:: of GoogleTest
using collision::BoxTree;
using collision::ChromaticCuller;
using collision::ChromaticSets;
using collision::CpuCullBackend;
using collision::CullJob;
using collision::CullMemory;
using collision::CullPlan;
using collision::SweptCorners;
using collision::TrianglePair;
using collision::ViewDirection;
using collision::find_hits_in_two_passes;
using collision::make_chromatic_sets;
using collision::view_along;
using collision::view_along_axis;
using test::Cloth;
using test::make_cloth;
using test::WholeView;

constexpr ContextKind kCullKinds[] = {ContextKind::EglDevice, ContextKind::EglSurfaceless, ContextKind::OsMesa};

std::vector<std::unique_ptr<GlCullBackend>> all_backends() {
    std::vector<std::unique_ptr<GlCullBackend>> backends;
    for (const ContextKind kind : kCullKinds) {
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

TEST(GpuCull, EveryContextAnswersAsTheCpuReferenceDoesBitForBit) {
    const auto backends = all_backends();
    if (backends.empty()) GTEST_SKIP() << "no OpenGL 4.5 with layers on this machine";
    const Cloth cloth = make_cloth(16, 8, 1);
    const auto prisms = cloth.prisms();
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

/// Another way to the random numbers of the collision tests.
struct Numbers {
    anatomy::Random random;
    double real(double from, double to) { return from + (to - from) * 0.5 * (random.cube().x() + 1.0); }
    std::uint64_t bits() { return static_cast<std::uint64_t>(real(0.0, 1e9)); }
};

TEST(GpuCull, OcclusionQueriesGiveTheBitsOfTheOrderFreeForm) {
    const Cloth cloth = make_cloth(8, 5, 4);
    const auto prisms = cloth.prisms();
    const ChromaticSets sets = make_chromatic_sets(cloth.topology.triangles, cloth.t0.size());
    int tried = 0;
    for (const ContextKind kind : kCullKinds) {
        auto canvas = GlCanvas::make({.order = {kind}});
        if (!canvas.ok()) {
            std::printf("%s is not there: %s\n", name_of(kind), canvas.error().message.c_str());
            continue;
        }
        ++tried;
        WholeView whole(prisms, cloth.topology.triangles, sets, tried % 3, tried == 2, 75);
        whole.job.memory = CullMemory::Fronts;
        std::vector<std::uint8_t> expected(whole.questions.size(), 7), hits(whole.questions.size(), 7);
        CpuCullBackend twin;
        ASSERT_TRUE(twin.find_hits(whole.job, expected).ok());
        const auto queries = find_hits_in_two_passes(whole.job, **canvas, hits);
        ASSERT_TRUE(queries.ok()) << queries.error().message;
        std::printf("%s: %llu queries\n", (*canvas)->name().c_str(), static_cast<unsigned long long>(*queries));
        EXPECT_EQ(hits, expected) << (*canvas)->name();
        EXPECT_GT(std::count(hits.begin(), hits.end(), 0), 50);
        EXPECT_GT(std::count(hits.begin(), hits.end(), 1), 50);
    }
    if (tried == 0) GTEST_SKIP() << "no OpenGL 4.5 on this machine";
}

TEST(GpuCull, HardPrismsThatTouchAreNeverFreeAndTheCpuReferenceAgrees) {
    auto backend = GlCullBackend::make();
    if (!backend.ok()) GTEST_SKIP() << backend.error().message;
    for (const int size : {1, 2, 7, 64, 256})
        for (int view = 0; view < 3; ++view) {
            SCOPED_TRACE(::testing::Message() << "seed 62, size " << size << ", view " << view);
            Numbers numbers{anatomy::Random(62)};
            const ViewDirection direction = view < 2 ? view_along_axis(view, view == 1) : view_along(Vec3(-1.0, 0.7, 2.0));
            const collision::testing::HardPrisms hard(numbers, direction, size, 150);
            std::vector<std::uint8_t> expected(hard.questions.size()), hits(hard.questions.size());
            for (const CullMemory memory : {CullMemory::Fronts, CullMemory::Intervals}) {
                const auto done = (*backend)->find_hits(hard.job(size, memory), hits);
                ASSERT_TRUE(done.ok()) << done.error().message;
                EXPECT_EQ(collision::testing::count_lost(hard, hits), 0u);
                CpuCullBackend twin;
                ASSERT_TRUE(twin.find_hits(hard.job(size, memory), expected).ok());
                EXPECT_EQ(hits, expected);
            }
        }
    EXPECT_GT(collision::testing::HardPrisms::kSets, 32u);
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

TEST(GpuCull, TheSamePairsAreLeftWithEveryCuller) {
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
    EXPECT_THAT(backend.error().message, ::testing::HasSubstr("libNoSuchEgl.so.1"));
}

TEST(GpuCull, WhatThisMachineCanIsSaidInWords) {
    const auto lines = describe_graphics();
    for (const GraphicsLine& line : lines) std::printf("%s: %s\n", line.what.c_str(), line.how.c_str());
    ASSERT_GE(lines.size(), 2u);
    EXPECT_EQ(lines.back().what, "culling");
    const auto nothing = describe_graphics({.order = {}});
    ASSERT_EQ(nothing.size(), 2u);
    EXPECT_EQ(nothing[0].what, "none");
    EXPECT_THAT(nothing[1].how, ::testing::HasSubstr("CPU reference"));
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
} // namespace trocar::engine
