// The law of stage II: the final contacts are the same with every culler, on surfaces made here and of the test data, in motion: the small
// ones by every way, larger ones by OpenGL and the CPU reference. Calls of OpenGL are counted, and it leaves what the reference leaves: a
// context that draws nothing, or culls nothing, breaks the law.
#include "assets/anatomy/random.hpp"
#include "base/box.hpp"
#include "collision/search/contact_search.hpp"
#include "engine/render/culled_search.hpp"
#include "engine/render/gl_api.hpp"
#include "engine/render/gl_cull_backend.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/time/clock.hpp"
#include "tests/made/surfaces.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace trocar::engine {
namespace {

using collision::SearchContact;

constexpr std::size_t kMostOfALaw = 1500, kMostByQueries = 400; // at 6000 it holds as well, and takes a minute

struct Hit {
    ContactOrigin origin;
    Index a, b;
    double time;
    friend bool operator==(const Hit&, const Hit&) = default;
};

std::vector<Hit> hits_of(const std::vector<SearchContact>& found) {
    std::vector<Hit> hits;
    for (const SearchContact& f : found) hits.push_back({f.contact.origin, f.id_a, f.id_b, f.contact.time});
    std::sort(hits.begin(), hits.end(),
              [](const Hit& x, const Hit& y) { return std::tie(x.origin, x.a, x.b, x.time) < std::tie(y.origin, y.a, y.b, y.time); });
    return hits;
}

/// Squeezed into itself along one axis, with a wrinkle: every organ and animal touches itself then.
std::vector<Vec3> squeeze(const std::vector<Vec3>& from, anatomy::Random& random) {
    Box3 box;
    for (const Vec3& p : from) box.add(p);
    int axis = 0;
    box.extent().minCoeff(&axis);
    const double middle = 0.5 * (box.lo[axis] + box.hi[axis]), wrinkle = 0.002 * box.longest_edge();
    std::vector<Vec3> to;
    for (const Vec3& p : from) {
        Vec3 q = p;
        q[axis] = middle - 0.3 * (p[axis] - middle);
        to.push_back(q + wrinkle * random.cube());
    }
    return to;
}

struct Method {
    const char* name;
    CulledSearch::Options options;
};

/// Calls that a context received. Entry points are plain functions, so one context at a time.
struct GlCalls {
    std::uint64_t draws = 0, queries = 0, answers = 0, read_backs = 0;
    GlApi real;
};
GlCalls calls;

void APIENTRY count_draw(GLenum mode, GLint first, GLsizei count) {
    ++calls.draws;
    calls.real.DrawArrays(mode, first, count);
}
void APIENTRY count_query(GLenum target) {
    ++calls.queries;
    calls.real.EndQuery(target);
}
void APIENTRY count_answer(GLuint query, GLenum what, GLuint* value) {
    ++calls.answers;
    calls.real.GetQueryObjectuiv(query, what, value);
}
void APIENTRY count_read_back(GLuint buffer, GLintptr offset, GLsizeiptr size, void* data) {
    ++calls.read_backs;
    calls.real.GetNamedBufferSubData(buffer, offset, size, data);
}
ContextOptions counted() {
    ContextOptions options;
    options.adjust = [](GlApi& gl) {
        calls = {.real = gl};
        gl.DrawArrays = count_draw;
        gl.EndQuery = count_query;
        gl.GetQueryObjectuiv = count_answer;
        gl.GetNamedBufferSubData = count_read_back;
    };
    return options;
}
bool has_opengl() {
    static const bool there = GlCullBackend::make().ok();
    return there;
}

/// Pairs of triangles before and after stage II, of all surfaces that were tried.
struct Culled {
    std::size_t near = 0, left = 0;
    double look_ms = 0.0;
};

/// The calls of OpenGL, from the counters of its entry points; what it leaves, against the CPU reference. Without OpenGL the note.
void expect_drawn(const Method& method, const CulledSearch& culled, std::span<const collision::TrianglePair> reference_pairs) {
    if (!has_opengl()) {
        EXPECT_FALSE(culled.notes().empty()) << method.name << " is missing, and not reported";
        return;
    }
    EXPECT_NE(culled.backend(), "CPU reference") << method.name << " was given up";
    EXPECT_TRUE(culled.notes().empty()) << culled.notes().front();
    const auto& culler = *culled.jobs().front().culler;
    EXPECT_TRUE(std::ranges::equal(culler.pairs(), reference_pairs)) << method.name << " leaves other pairs than the CPU reference";
    if (culler.counts().near_pairs == 0) return;
    EXPECT_GT(calls.draws, 0u) << method.name;
    if (method.options.method == CullMethod::Gl) {
        EXPECT_GT(calls.read_backs, 0u);
    } else if (culler.counts().queries.queries > 0) { // the 1D tests may have separated all pairs
        EXPECT_EQ(calls.queries, culler.counts().queries.queries);
        EXPECT_EQ(calls.answers, calls.queries);
    }
}

/// The same by the CPU.
CulledSearch::Options cpu_reference_of(CulledSearch::Options options) {
    if (options.method == CullMethod::Gl) options.method = CullMethod::Cpu;
    options.contexts.order.clear();
    return options;
}

/// Contacts with themselves on the way to t1, with every culler.
/// by_opengl   added to
/// returns     how many
std::size_t expect_the_law(const TriMesh& mesh, const std::vector<Vec3>& t1, std::span<const Method> methods, Culled& by_opengl) {
    const auto topology = collision::make_topology(mesh.triangles, mesh.vertices.size());
    const collision::SurfaceTopology* surfaces[] = {&topology};
    const std::span<const Vec3> positions[] = {mesh.vertices};
    const collision::SurfaceMotion motion[] = {{&topology, mesh.vertices, t1}};
    collision::ContactSearch search;
    search.build(surfaces, positions, {});
    search.refit(motion);
    search.find_candidates();
    std::vector<SearchContact> found;
    search.decide(found);
    const std::vector<Hit> expected = hits_of(found);
    for (const Method& method : methods) {
        CulledSearch culled(surfaces, positions, method.options);
        const double look_ms = culled.find_candidates(motion).look_ms;
        if (method.options.method == CullMethod::Gl || method.options.method == CullMethod::Query) {
            CulledSearch twin(surfaces, positions, cpu_reference_of(method.options));
            twin.find_candidates(motion);
            expect_drawn(method, culled, twin.jobs().front().culler->pairs());
            by_opengl.near += culled.jobs().front().culler->counts().near_pairs;
            by_opengl.left += culled.jobs().front().culler->counts().left_pairs;
            by_opengl.look_ms += look_ms;
        }
        search.start_given(motion);
        const auto& job = culled.jobs().front();
        search.give_candidates(0, 0, job.candidates.vertex_face, job.candidates.face_vertex, job.candidates.edge_edge);
        found.clear();
        search.decide(found);
        EXPECT_TRUE(hits_of(found) == expected) << method.name << ": " << found.size() << " contacts of " << expected.size();
    }
    return expected.size();
}

const Method kNoStageTwo{"no stage II", {.method = CullMethod::None}};
const Method kCpuReference{"CPU reference, intervals", {.method = CullMethod::Cpu, .plan = {.resolution = 256, .max_rounds = 1}}};
const Method kFronts{"CPU reference, fronts",
                     {.method = CullMethod::Cpu, .plan = {.memory = collision::CullMemory::Fronts, .resolution = 128, .max_rounds = 1}}};
const Method kOpenGl{"OpenGL", {.method = CullMethod::Gl, .plan = {.resolution = 64, .max_rounds = 1}, .contexts = counted()}};
const Method kQueries{"queries by OpenGL",
                      {.method = CullMethod::Query, .queries = {.resolution = 64, .max_rounds = 1}, .contexts = counted()}};

TEST(CullLaw, TheContactsOfMadeSurfacesAreTheSameWithEveryCuller) {
    const Method methods[] = {kNoStageTwo, kCpuReference, kFronts, kOpenGl, kQueries};
    std::size_t tried = 0, touching = 0;
    Culled by_opengl;
    for (const std::size_t triangles : {320u, 1300u})
        for (const made::Named& one : made::make_all(triangles, triangles)) {
            if (one.mesh.triangles.size() > kMostOfALaw) continue;
            anatomy::Random random(++tried);
            SCOPED_TRACE(::testing::Message() << one.name << " (seed " << tried << ")");
            const bool queries = one.mesh.triangles.size() <= kMostByQueries; // slow
            const std::vector<Vec3> t1 = squeeze(one.mesh.vertices, random);
            touching += expect_the_law(one.mesh, t1, std::span(methods).first(queries ? 5 : 4), by_opengl) > 0;
        }
    std::printf("%zu surfaces, %zu of them touch themselves; OpenGL left %zu of %zu pairs\n", tried, touching, by_opengl.left,
                by_opengl.near);
    if (has_opengl()) {
        EXPECT_LT(by_opengl.left, by_opengl.near);
    }
    EXPECT_GT(tried, 10u);
    EXPECT_GT(touching, tried / 2);
}

TEST(CullLaw, TheContactsOfEverySurfaceAreTheSameWithEveryCuller) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data))
        if (entry.is_regular_file() && entry.file_size() < 500'000) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    const Method methods[] = {kNoStageTwo, kCpuReference, kFronts, kOpenGl, kQueries};
    std::size_t tried = 0, touching = 0;
    Culled by_opengl;
    for (const auto& file : files) {
        const auto mesh = read_surface(file, {.weld = true});
        if (!mesh.ok() || mesh->triangles.empty() || mesh->triangles.size() > kMostOfALaw) continue;
        anatomy::Random random(tried + 1);
        const std::vector<Vec3> t1 = squeeze(mesh->vertices, random);
        SCOPED_TRACE(::testing::Message() << file << " (seed " << ++tried << ")");
        const bool queries = mesh->triangles.size() <= kMostByQueries; // slow
        touching += expect_the_law(*mesh, t1, std::span(methods).first(queries ? 5 : 4), by_opengl) > 0;
    }
    std::printf("%zu surfaces, %zu of them touch themselves; OpenGL left %zu of %zu pairs\n", tried, touching, by_opengl.left,
                by_opengl.near);
    EXPECT_LT(by_opengl.left, by_opengl.near);
    EXPECT_GT(tried, 10u);
    EXPECT_GT(touching, tried / 2);
}

/// Only a slab in its middle is squeezed: as many contacts as a small mesh has.
std::vector<Vec3> pinch(const std::vector<Vec3>& from, anatomy::Random& random) {
    Box3 box;
    for (const Vec3& p : from) box.add(p);
    int axis = 0;
    box.extent().maxCoeff(&axis);
    constexpr double kSlab = 0.02; // of the longest edge, to either side
    const double middle = 0.5 * (box.lo[axis] + box.hi[axis]), half = kSlab * box.longest_edge();
    std::vector<Vec3> to = from;
    const std::vector<Vec3> squeezed = squeeze(from, random);
    for (std::size_t v = 0; v < from.size(); ++v)
        if (std::abs(from[v][axis] - middle) < half) to[v] = squeezed[v];
    return to;
}

/// TROCAR_LONG_TESTS: OpenGL on every surface, on any renderer; minutes in software.
bool takes_long() { return std::getenv("TROCAR_LONG_TESTS") != nullptr; }

/// Sizes that are slow with OpenGL drawn by software.
constexpr std::size_t kMostByOpenGl = 8000;

void expect_the_law_pinched(const TriMesh& mesh) {
    anatomy::Random random(1);
    const Method methods[] = {kNoStageTwo, kCpuReference, kOpenGl};
    const bool open_gl = takes_long() || mesh.triangles.size() <= kMostByOpenGl;
    Culled by_opengl;
    const StopWatch watch;
    const std::size_t contacts = expect_the_law(mesh, pinch(mesh.vertices, random), std::span(methods).first(open_gl ? 3 : 2), by_opengl);
    std::printf("%zu triangles, %zu contacts, %.1f s", mesh.triangles.size(), contacts, 1e-3 * watch.elapsed_ms());
    if (open_gl)
        std::printf("; OpenGL left %zu of %zu pairs in %.2f s, %llu draws, %llu read-backs", by_opengl.left, by_opengl.near,
                    1e-3 * by_opengl.look_ms, static_cast<unsigned long long>(calls.draws),
                    static_cast<unsigned long long>(calls.read_backs));
    std::printf("\n");
    EXPECT_GT(mesh.triangles.size(), kMostOfALaw);
    EXPECT_GT(contacts, 0u);
    if (open_gl && has_opengl()) {
        EXPECT_LT(by_opengl.left, by_opengl.near);
    }
}

void expect_the_law_of_file(const char* name) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    const auto mesh = read_surface(std::filesystem::path(data) / name, {.weld = true});
    if (!mesh.ok()) GTEST_SKIP() << mesh.error().message;
    expect_the_law_pinched(*mesh);
}

TEST(CullLaw, LargeMadeSurfacesKeepTheirContactsWithEveryCuller) {
    for (const TriMesh& mesh : {made::make_animal(1, 6000), made::make_organ(1, 4), made::make_artery_tree(1, 7000), made::make_organ(2, 5),
                                made::make_overlapping_arteries(1, 40), made::make_drape(100, 0.6)}) {
        SCOPED_TRACE(mesh.triangles.size());
        expect_the_law_pinched(mesh);
    }
}

class LargeSurface : public ::testing::TestWithParam<const char*> {};

TEST_P(LargeSurface, KeepsItsContactsWithEveryCuller) { expect_the_law_of_file(GetParam()); }

INSTANTIATE_TEST_SUITE_P(CullLaw, LargeSurface,
                         ::testing::Values("cow/cow_viewpoint_5.8k.obj.gz", "cow/spot_23k.obj.gz",
                                           "organs/infinytoolkit_liver_visual_5k.obj.gz", "organs/hra_vhm_spleen_17k.obj.gz",
                                           "organs/hra_vhf_liver_capsule_30k.obj.gz", "stanford/bunny_7k_closed.off.gz",
                                           "vessels/beamadapter_aneurysm3d_6.4k.obj.gz", "vessels/gmsh_aneurysm_20k.stl.gz",
                                           "vessels/hra_vhf_arteries_101k.obj.gz"));

class VeryLargeSurface : public ::testing::TestWithParam<const char*> {};

TEST_P(VeryLargeSurface, KeepsItsContactsWithEveryCuller) {
    if (!takes_long()) GTEST_SKIP() << "TROCAR_LONG_TESTS is not set";
    expect_the_law_of_file(GetParam());
}

INSTANTIATE_TEST_SUITE_P(CullLaw, VeryLargeSurface,
                         ::testing::Values("cloth/skirt_64k.obj.gz", "cloth/multilayer_garment_drape_84k.obj.gz",
                                           "stanford/bunny_60k_manifold.obj.gz", "stanford/armadillo_86k.obj.gz"));

} // namespace
} // namespace trocar::engine
