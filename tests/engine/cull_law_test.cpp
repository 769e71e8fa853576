// The law of stage II: the final contacts are the same whoever culls, on every surface of the test data that is small enough, in motion.
#include "assets/anatomy/random.hpp"
#include "base/box.hpp"
#include "collision/contact_search.hpp"
#include "engine/gpu/culled_search.hpp"
#include "engine/io/read_surface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace seldinger::engine {
namespace {

using collision::SearchContact;

constexpr std::size_t kMostTriangles = 1500, kMostByQueries = 400; // at 6000 it holds as well, and takes a minute

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

TEST(CullLaw, WhoeverCullsTheContactsOfEverySurfaceAreTheSame) {
    const char* data = std::getenv("SELDINGER_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "SELDINGER_TEST_DATA is not set";
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data))
        if (entry.is_regular_file() && entry.file_size() < 500'000) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    struct Method {
        const char* name;
        CulledSearch::Options options;
    };
    std::vector<Method> methods = {
        {"no stage II", {.method = CullMethod::None}},
        {"CPU twin, intervals", {.method = CullMethod::Cpu, .plan = {.resolution = 256, .max_rounds = 1}}},
        {"CPU twin, fronts",
         {.method = CullMethod::Cpu, .plan = {.memory = collision::CullMemory::Fronts, .resolution = 128, .max_rounds = 1}}},
        {"OpenGL", {.method = CullMethod::Gl, .plan = {.resolution = 64, .max_rounds = 1}}},
        {"queries by OpenGL", {.method = CullMethod::Query, .queries = {.resolution = 64, .max_rounds = 1}}},
    };
    std::size_t tried = 0, touching = 0;
    for (const auto& file : files) {
        const auto mesh = read_surface(file, {.weld = true});
        if (!mesh.ok() || mesh->triangles.empty() || mesh->triangles.size() > kMostTriangles) continue;
        anatomy::Random random(tried + 1);
        const std::vector<Vec3> t1 = squeeze(mesh->vertices, random);
        const auto topology = collision::make_topology(mesh->triangles, mesh->vertices.size());
        const collision::SurfaceTopology* surfaces[] = {&topology};
        const std::span<const Vec3> positions[] = {mesh->vertices};
        const collision::SurfaceMotion motion[] = {{&topology, mesh->vertices, t1}};
        collision::ContactSearch search;
        search.build(surfaces, positions, {});
        search.refit(motion);
        search.find_candidates();
        std::vector<SearchContact> found;
        search.decide(found);
        const std::vector<Hit> expected = hits_of(found);
        ++tried;
        touching += !expected.empty();
        for (const Method& method : methods) {
            if (method.options.method == CullMethod::Query && mesh->triangles.size() > kMostByQueries) continue; // slow
            CulledSearch culled(surfaces, positions, method.options);
            culled.find_candidates(motion);
            search.start_given(motion);
            const auto& job = culled.jobs().front();
            search.give_candidates(0, 0, job.candidates.vertex_face, job.candidates.face_vertex, job.candidates.edge_edge);
            found.clear();
            search.decide(found);
            EXPECT_EQ(hits_of(found), expected) << file << ", " << method.name << " (seed " << tried << ")";
        }
    }
    std::printf("%zu surfaces, %zu of them touch themselves\n", tried, touching);
    EXPECT_GT(tried, 10u);
    EXPECT_GT(touching, tried / 2);
}

} // namespace
} // namespace seldinger::engine
