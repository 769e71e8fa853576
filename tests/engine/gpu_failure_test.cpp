// Culling when OpenGL fails. The driver is the real one; single calls of it are suppressed or answered
// in its place, as a driver without memory, or one that has lost its device, would.
#include "collision/culling/cull_twin.hpp"
#include "engine/render/culled_search.hpp"
#include "engine/render/gl_api.hpp"
#include "engine/render/gl_canvas.hpp"
#include "engine/render/gl_cull_backend.hpp"
#include "gpu_fixture.hpp"

#include <gmock/gmock.h>

#include <algorithm>

namespace trocar::engine {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// The calls of one driver that are tampered with. Entry points are plain functions, so one driver at a time.
struct Driver {
    GlApi real;
    GLenum pending = GL_NO_ERROR;
    int widest = 1 << 20, deepest = 1 << 20; // layers of textures that it has memory for
    int calls_until_lost = 1 << 30;          // of GetGraphicsResetStatus
    bool reads = true;
};
Driver driver;

void APIENTRY break_source(GLuint shader, GLsizei count, const GLchar* const* text, const GLint* length) {
    EXPECT_EQ(count, 1);
    const std::string broken = std::string(text[0]) + "\nfloat broken() { return this_is_not_declared; }\n";
    const GLchar* source = broken.c_str();
    driver.real.ShaderSource(shader, count, &source, length);
}
void APIENTRY lack_memory(GLuint texture, GLsizei levels, GLenum format, GLsizei width, GLsizei height, GLsizei depth) {
    if (width > driver.widest || depth > driver.deepest)
        driver.pending = GL_OUT_OF_MEMORY;
    else
        driver.real.TextureStorage3D(texture, levels, format, width, height, depth);
}
GLenum APIENTRY tell_pending_error() {
    const GLenum error = std::exchange(driver.pending, GL_NO_ERROR);
    return error != GL_NO_ERROR ? error : driver.real.GetError();
}
GLenum APIENTRY lose_the_device() {
    return --driver.calls_until_lost < 0 ? GL_UNKNOWN_CONTEXT_RESET : driver.real.GetGraphicsResetStatus();
}
void APIENTRY read_nothing(GLuint buffer, GLintptr offset, GLsizeiptr size, void* data) {
    if (driver.reads) driver.real.GetNamedBufferSubData(buffer, offset, size, data);
}

template <class Change>
ContextOptions tampered(Change change) {
    ContextOptions options;
    options.adjust = [change](GlApi& gl) {
        driver = {};
        driver.real = gl;
        change(gl);
    };
    return options;
}
bool has_layered_opengl() { return GlCullBackend::make().ok(); }

/// Pairs of triangles that a search leaves in one step, and its notes.
struct Answer {
    std::vector<collision::TrianglePair> left;
    std::vector<std::string> notes;
    std::string backend;
};
Answer search(const test::Cloth& cloth, CullMethod method, const ContextOptions& contexts, int resolution) {
    const collision::SurfaceTopology* surfaces[] = {&cloth.topology};
    const std::span<const Vec3> positions[] = {cloth.t0};
    CulledSearch culled(surfaces, positions,
                        {.method = method,
                         .distance = 0.01,
                         .plan = {.resolution = resolution, .adapt_resolution = false},
                         .queries = {.resolution = resolution, .adapt_resolution = false, .max_rounds = 1},
                         .contexts = contexts});
    const collision::SurfaceMotion motion[] = {cloth.motion()};
    culled.find_candidates(motion);
    const auto pairs = culled.jobs().front().culler->pairs();
    return {{pairs.begin(), pairs.end()}, culled.notes(), culled.backend()};
}
bool is_subset(const std::vector<collision::TrianglePair>& part, const std::vector<collision::TrianglePair>& whole) {
    return std::ranges::all_of(part, [&](const auto& pair) { return std::ranges::find(whole, pair) != whole.end(); });
}

TEST(GpuFailure, WithoutAnyOpenGlTheCpuReferenceWorksAndSaysWhy) {
    const test::Cloth cloth = test::make_cloth(16, 8, 5);
    const ContextOptions nothing{.egl_library = "libNoSuchEgl.so.1", .osmesa_library = "libNoSuchMesa.so.8"};
    const Answer expected = search(cloth, CullMethod::Cpu, {}, 96);
    const Answer answer = search(cloth, CullMethod::Gl, nothing, 96);
    EXPECT_EQ(answer.left, expected.left);
    EXPECT_EQ(answer.backend, "CPU reference");
    EXPECT_THAT(answer.notes, Contains(HasSubstr("libNoSuchEgl.so.1")));
    const Answer queries = search(cloth, CullMethod::Query, nothing, 96);
    EXPECT_EQ(queries.backend, "CPU reference");
    EXPECT_THAT(queries.notes, Contains(HasSubstr("libNoSuchMesa.so.8")));
}

TEST(GpuFailure, AShaderThatDoesNotCompileIsToldWithTheDriversLog) {
    if (!has_layered_opengl()) GTEST_SKIP() << "no OpenGL 4.5 with layers on this machine";
    const auto broken = tampered([](GlApi& gl) { gl.ShaderSource = break_source; });
    const auto backend = GlCullBackend::make(broken);
    ASSERT_FALSE(backend.ok());
    EXPECT_EQ(backend.error().code, ErrorCode::ToolFailed);
    std::printf("%s\n", backend.error().message.c_str());
    EXPECT_THAT(backend.error().message, HasSubstr("cannot compile shader cull_"));
    EXPECT_THAT(backend.error().message, HasSubstr("this_is_not_declared")); // the driver's own message
    EXPECT_FALSE(GlCanvas::make(broken).ok());
    const test::Cloth cloth = test::make_cloth(16, 8, 5);
    const Answer answer = search(cloth, CullMethod::Gl, broken, 96);
    EXPECT_EQ(answer.left, search(cloth, CullMethod::Cpu, {}, 96).left);
    EXPECT_THAT(answer.notes, Contains(HasSubstr("this_is_not_declared")));
}

TEST(GpuFailure, WithoutMemoryForAllLayersTheyAreDrawnInTurns) {
    if (!has_layered_opengl()) GTEST_SKIP() << "no OpenGL 4.5 with layers on this machine";
    const auto poor = tampered([](GlApi& gl) {
        driver.deepest = 3;
        gl.TextureStorage3D = lack_memory;
        gl.GetError = tell_pending_error;
    });
    const test::Cloth cloth = test::make_cloth(16, 8, 6);
    const auto prisms = cloth.prisms();
    const auto sets = collision::make_chromatic_sets(cloth.topology.triangles, cloth.t0.size());
    const test::WholeView whole(prisms, cloth.topology.triangles, sets, 2, false, 64);
    std::vector<std::uint8_t> expected(whole.questions.size()), hits(whole.questions.size());
    collision::CpuCullBackend twin;
    ASSERT_TRUE(twin.find_hits(whole.job, expected).ok());
    const auto backend = GlCullBackend::make(poor);
    ASSERT_TRUE(backend.ok()) << backend.error().message;
    const auto done = (*backend)->find_hits(whole.job, hits);
    ASSERT_TRUE(done.ok()) << done.error().message;
    EXPECT_LE((*backend)->layers(), 3);
    EXPECT_EQ(hits, expected);
}

TEST(GpuFailure, WithoutMemoryForOneLayerASmallerPictureIsTakenAndSaid) {
    if (!has_layered_opengl()) GTEST_SKIP() << "no OpenGL 4.5 with layers on this machine";
    const auto poor = tampered([](GlApi& gl) {
        driver.widest = 40;
        gl.TextureStorage3D = lack_memory;
        gl.GetError = tell_pending_error;
    });
    const test::Cloth cloth = test::make_cloth(16, 8, 7);
    const Answer answer = search(cloth, CullMethod::Gl, poor, 128);
    EXPECT_EQ(answer.left, search(cloth, CullMethod::Cpu, {}, 32).left); // halved until it fits
    EXPECT_THAT(answer.notes, Contains(HasSubstr("32 x 32")));
    EXPECT_NE(answer.backend, "CPU reference");
    const auto none = tampered([](GlApi& gl) {
        driver.widest = 0;
        gl.TextureStorage3D = lack_memory;
        gl.GetError = tell_pending_error;
    });
    const Answer twin = search(cloth, CullMethod::Gl, none, 128); // nothing fits at all
    EXPECT_EQ(twin.backend, "CPU reference");
    EXPECT_THAT(twin.notes, Contains(HasSubstr("no memory for one layer")));
    EXPECT_EQ(twin.left, search(cloth, CullMethod::Cpu, {}, 128).left);
}

TEST(GpuFailure, ALostContextLosesNoContact) {
    if (!has_layered_opengl()) GTEST_SKIP() << "no OpenGL 4.5 with layers on this machine";
    const test::Cloth cloth = test::make_cloth(16, 8, 8);
    const Answer near = search(cloth, CullMethod::None, {}, 96), expected = search(cloth, CullMethod::Cpu, {}, 96);
    for (const int left : {0, 1, 2}) { // in the first view, or in a later one
        const auto lost = tampered([left](GlApi& gl) {
            driver.calls_until_lost = left;
            gl.GetGraphicsResetStatus = lose_the_device;
        });
        const Answer answer = search(cloth, CullMethod::Gl, lost, 96);
        EXPECT_EQ(answer.backend, "CPU reference");
        EXPECT_THAT(answer.notes, Contains(HasSubstr("context was lost")));
        EXPECT_TRUE(is_subset(answer.left, near.left));
        EXPECT_LE(answer.left.size(), near.left.size());
        if (left == 0) {
            EXPECT_EQ(answer.left, expected.left);
        }
    }
    const auto lost_queries = tampered([](GlApi& gl) {
        driver.calls_until_lost = 2;
        gl.GetGraphicsResetStatus = lose_the_device;
    });
    const Answer queries = search(cloth, CullMethod::Query, lost_queries, 48);
    EXPECT_EQ(queries.backend, "CPU reference");
    EXPECT_THAT(queries.notes, Contains(HasSubstr("context was lost")));
}

TEST(GpuFailure, AnswersThatDoNotComeBackAreNoAnswers) {
    if (!has_layered_opengl()) GTEST_SKIP() << "no OpenGL 4.5 with layers on this machine";
    const auto silent = tampered([](GlApi& gl) {
        driver.reads = false;
        gl.GetNamedBufferSubData = read_nothing;
    });
    const test::Cloth cloth = test::make_cloth(16, 8, 9);
    const Answer answer = search(cloth, CullMethod::Gl, silent, 96);
    EXPECT_EQ(answer.left, search(cloth, CullMethod::Cpu, {}, 96).left);
    EXPECT_THAT(answer.notes, Contains(HasSubstr("could not be read back")));
}

} // namespace
} // namespace trocar::engine
