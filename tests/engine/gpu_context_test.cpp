#include "gpu_scene.hpp"

#include <gmock/gmock.h>

// OSMesa keeps a list of the frame buffers that were ever current and never frees it: 640 bytes of its own, seen by the
// leak check at the end. Nothing of ours is allocated by that library.
extern "C" const char* __lsan_default_suppressions(); // NOLINT(bugprone-reserved-identifier): the hook's given name
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa\n"; } // NOLINT(bugprone-reserved-identifier)

namespace trocar::engine {
namespace {

constexpr ContextKind kAllKinds[] = {ContextKind::EglDevice, ContextKind::EglSurfaceless, ContextKind::OsMesa};

TEST(GpuContext, MissingLibrariesAreAnErrorThatNamesEveryAttemptAndThePackages) {
    const auto context = make_context({.egl_library = "libNoSuchEgl.so.1", .osmesa_library = "libNoSuchMesa.so.8"});
    ASSERT_FALSE(context.ok());
    EXPECT_EQ(context.error().code, ErrorCode::MissingTool);
    for (const char* word : {"EGL device", "EGL surfaceless", "OSMesa", "libNoSuchEgl.so.1", "libNoSuchMesa.so.8", "libegl1"})
        EXPECT_THAT(context.error().message, testing::HasSubstr(word));
}

TEST(GpuContext, ALibraryThatIsSomethingElseIsAnErrorNotACrash) {
    const auto context = make_context({.egl_library = "libz.so.1", .osmesa_library = "libz.so.1"});
    ASSERT_FALSE(context.ok());
    EXPECT_THAT(context.error().message, testing::HasSubstr("not EGL"));
    EXPECT_THAT(context.error().message, testing::HasSubstr("not OSMesa"));
}

TEST(GpuContext, TryingNothingIsAnError) {
    EXPECT_FALSE(make_context({.order = {}}).ok());
    EXPECT_FALSE(Renderer::make({.order = {}}).ok());
}

TEST(GpuContext, FallsBackToTheNextKindAndSaysWhy) {
    const auto context = make_context({.egl_library = "libNoSuchEgl.so.1"});
    if (!context.ok()) GTEST_SKIP() << "OSMesa is not installed: " << context.error().message;
    EXPECT_EQ((*context)->kind(), ContextKind::OsMesa);
    ASSERT_EQ((*context)->attempts().size(), 3U);
    EXPECT_THAT((*context)->attempts()[0].reason, testing::HasSubstr("libNoSuchEgl.so.1"));
    EXPECT_TRUE((*context)->attempts()[2].reason.empty());
}

TEST(GpuContext, EveryKindThatIsThereDrawsTheSamePictures) {
    const test::SmallScene small;
    std::vector<Picture> shaded;
    std::vector<Picture> xray;
    std::vector<std::unique_ptr<Renderer>> renderers; // all alive at once: their tables and contexts must not mix
    for (const ContextKind kind : kAllKinds) {
        auto renderer = Renderer::make({.order = {kind}});
        if (!renderer.ok()) {
            std::printf("%s is not there: %s\n", name_of(kind), renderer.error().message.c_str());
            continue;
        }
        EXPECT_EQ((*renderer)->context().kind(), kind);
        std::printf("%s: %s, %s\n", name_of(kind), (*renderer)->context().renderer_name().c_str(),
                    (*renderer)->context().version().c_str());
        renderers.push_back(std::move(renderer).value());
    }
    if (renderers.empty()) GTEST_SKIP() << "no OpenGL 4.5 on this machine";
    for (int round = 0; round < 2; ++round) // in turns, so that each context is let go and taken again
        for (const auto& renderer : renderers) {
            auto a = renderer->shaded(small.scene(), small.camera(), test::kWidth, test::kHeight);
            auto b = renderer->fluoroscopy(small.scene(), small.camera(), test::kWidth, test::kHeight);
            ASSERT_TRUE(a.ok()) << a.error().message;
            ASSERT_TRUE(b.ok()) << b.error().message;
            shaded.push_back(*std::move(a));
            xray.push_back(*std::move(b));
        }
    for (std::size_t i = 1; i < shaded.size(); ++i) {
        EXPECT_LT(test::compare(shaded[0], shaded[i]).mean, 0.25);
        EXPECT_LT(test::compare(xray[0], xray[i]).mean, 0.25);
        EXPECT_LE(test::compare(xray[0], xray[i]).worst, 24);
    }
}

} // namespace
} // namespace trocar::engine
