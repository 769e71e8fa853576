// The chromatic decomposition of surfaces made here and of every one of the test data, and crossings of those whose crossings are known.
#include "base/self_intersection.hpp"
#include "collision/culling/cull_twin.hpp"
#include "collision/culling/image_space.hpp"
#include "bench/dented.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/prepare/chromatic_report.hpp"
#include "tests/made/surfaces.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace trocar::engine {
namespace {

/// Larger surfaces are tested on request only: the test stays short.
constexpr std::size_t kMostTriangles = 31000;

std::vector<std::filesystem::path> surfaces_of(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        for (const char* kind : {".obj", ".ply", ".stl", ".STL", ".off"})
            if (entry.is_regular_file() && name.find(kind) != std::string::npos && entry.file_size() < 2'000'000)
                files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

void expect_both_guarantees(const TriMesh& mesh, const std::string& name) {
    collision::ChromaticSets sets;
    const ChromaticReport report = report_chromatic(mesh.triangles, mesh.vertices.size(), &sets);
    const collision::TriangleStars stars(mesh.triangles, mesh.vertices.size());
    const auto found = collision::check_sets(sets, mesh.triangles, stars);
    EXPECT_EQ(found.adjacent_in_set, 0u) << name;
    EXPECT_EQ(found.second_neighbours, 0u) << name;
    EXPECT_EQ(report.colours, sets.count());
}

TEST(ChromaticMade, BothGuaranteesHoldOnEveryKindOfSurface) {
    for (const std::size_t triangles : {600u, 5000u})
        for (const made::Named& one : made::make_all(triangles, triangles)) expect_both_guarantees(one.mesh, one.name);
}

TEST(ChromaticData, BothGuaranteesHoldOnEverySurface) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    std::size_t tried = 0;
    for (const auto& file : surfaces_of(data)) {
        const auto mesh = read_surface(file, {.weld = true});
        if (!mesh.ok() || mesh->triangles.size() > kMostTriangles) continue; // broken on purpose, or too large
        expect_both_guarantees(*mesh, file.string());
        ++tried;
    }
    std::printf("%zu surfaces\n", tried);
    EXPECT_GT(tried, 25u);
}

TEST(ChromaticMade, AnOrdinaryMeshTakesAboutTwentySetsAndAGridEighteen) {
    for (const TriMesh& mesh : {made::make_animal(1, 7000), made::make_organ(1, 4)}) {
        const auto report = report_chromatic(mesh.triangles, mesh.vertices.size());
        std::printf("%zu triangles: %u sets\n", mesh.triangles.size(), report.colours);
        EXPECT_LE(report.colours, 28u);
        EXPECT_GE(report.colours, 13u) << "a vertex of six triangles and their neighbours";
    }
    const TriMesh cloth = made::make_drape(100, 0.3);
    const auto of_cloth = report_chromatic(cloth.triangles, cloth.vertices.size());
    EXPECT_EQ(of_cloth.colours, 18u);
    EXPECT_TRUE(of_cloth.from_grid);
}

TEST(ChromaticData, AnOrdinaryMeshTakesAboutTwentySetsAndAGridEighteen) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    const auto bunny = read_surface(std::filesystem::path(data) / "stanford/bunny_7k_closed.off.gz");
    const auto cloth = read_surface(std::filesystem::path(data) / "cloth/vega_cloth_20k.obj.gz");
    ASSERT_TRUE(bunny.ok() && cloth.ok());
    const auto of_bunny = report_chromatic(bunny->triangles, bunny->vertices.size());
    const auto of_cloth = report_chromatic(cloth->triangles, cloth->vertices.size());
    std::printf("bunny %zu triangles: %u sets in %.3f s; cloth %zu: %u in %.3f s\n", bunny->triangles.size(), of_bunny.colours,
                of_bunny.seconds, cloth->triangles.size(), of_cloth.colours, of_cloth.seconds);
    EXPECT_LE(of_bunny.colours, 28u);
    EXPECT_EQ(of_cloth.colours, 18u);
    EXPECT_TRUE(of_cloth.from_grid);
}

TEST(ChromaticData, ImageSpaceLosesNoneOfTheKnownCrossings) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    struct Known {
        const char* file;
        std::size_t crossings; // as the data's manifest counts them
    };
    for (const Known& known : {Known{"cloth/ipc_two-cubes-intersecting.ply", 96}, Known{"cloth/ipc_two-cubes-close.ply", 0},
                               Known{"stanford/armadillo_25k_sofa.obj.gz", 1}}) {
        const auto mesh = read_surface(std::filesystem::path(data) / known.file);
        ASSERT_TRUE(mesh.ok());
        collision::ImageSpaceCuller culler(mesh->triangles, mesh->vertices.size());
        collision::CpuCullBackend twin;
        const auto left = culler.find_colliding_set(mesh->vertices, {.resolution = 256}, twin);
        ASSERT_TRUE(left.ok());
        EXPECT_EQ(collision::find_crossings(mesh->triangles, mesh->vertices, *left).size(), known.crossings) << known.file;
        EXPECT_LT(left->size(), mesh->triangles.size() / 2) << known.file;
    }
}

TEST(ChromaticMade, ImageSpaceLosesNoneOfTheCrossingsThatATreeFinds) {
    std::size_t crossing = 0;
    for (const made::Named& one : made::make_all(5000)) {
        const auto truth = find_self_intersections(one.mesh);
        collision::ImageSpaceCuller culler(one.mesh.triangles, one.mesh.vertices.size());
        collision::CpuCullBackend twin;
        const auto left = culler.find_colliding_set(one.mesh.vertices, {.resolution = 256}, twin);
        ASSERT_TRUE(left.ok());
        EXPECT_EQ(collision::find_crossings(one.mesh.triangles, one.mesh.vertices, *left).size(), truth.count) << one.name;
        crossing += truth.count > 0;
    }
    EXPECT_GE(crossing, 2u);
}

/// Surfaces whose crossings image-space culling was tested on.
struct Pruned {
    std::size_t tried = 0, crossing = 0, by_patches = 0, triangles = 0;
    void print() const {
        std::printf("%zu surfaces; %zu of %zu cross themselves; patches pruned %zu of %zu triangles\n", tried, crossing, 2 * tried,
                    by_patches, triangles);
    }
};

/// Whole patches first or triangle by triangle: the crossings of the surface are those that a tree finds, as it is and dented.
void expect_no_crossing_lost(TriMesh mesh, const std::string& name, Pruned& sum) {
    collision::ImageSpaceCuller culler(mesh.triangles, mesh.vertices.size());
    collision::CpuCullBackend twin;
    for (const bool dented : {false, true}) {
        if (dented) push_top_down(mesh);
        const auto truth = find_self_intersections(mesh);
        sum.crossing += truth.count > 0;
        for (const bool patches : {true, false}) {
            const auto left = culler.find_colliding_set(mesh.vertices, {.resolution = 200, .patches = patches}, twin);
            ASSERT_TRUE(left.ok());
            const auto found = collision::find_crossings(mesh.triangles, mesh.vertices, *left);
            EXPECT_TRUE(std::ranges::equal(found, truth.pairs, [](const auto& f, const auto& t) { return f.a == t[0] && f.b == t[1]; }))
                << name << (patches ? ", patches" : "") << (dented ? ", dented: " : ": ") << found.size() << " of " << truth.count;
            if (!patches) continue;
            sum.triangles += mesh.triangles.size();
            for (const auto& pass : culler.passes())
                if (pass.patches > 0) sum.by_patches += pass.triangles - pass.triangles_left;
        }
    }
    ++sum.tried;
}

TEST(ChromaticMade, ImageSpaceCullingOfPatchesAndOfTrianglesLosesNoCrossing) {
    Pruned sum;
    for (const std::size_t triangles : {600u, 3000u})
        for (const made::Named& one : made::make_all(triangles, triangles)) expect_no_crossing_lost(one.mesh, one.name, sum);
    sum.print();
    EXPECT_GT(sum.tried, 15u);
    EXPECT_GT(sum.crossing, 15u);
    EXPECT_GT(sum.by_patches, 0u);
}

TEST(ChromaticData, ImageSpaceCullingOfPatchesAndOfTrianglesLosesNoCrossingOfAnySurface) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    const std::size_t most = std::getenv("TROCAR_LONG_TESTS") != nullptr ? kMostTriangles : 13000; // a minute; longer for all
    Pruned sum;
    for (const auto& file : surfaces_of(data)) {
        auto mesh = read_surface(file, {.weld = true});
        if (!mesh.ok() || mesh->triangles.empty() || mesh->triangles.size() > most) continue;
        expect_no_crossing_lost(*mesh, file.string(), sum);
    }
    sum.print();
    EXPECT_GT(sum.tried, 25u);
    EXPECT_GT(sum.crossing, 25u);
    EXPECT_GT(sum.by_patches, 0u);
}

} // namespace
} // namespace trocar::engine
