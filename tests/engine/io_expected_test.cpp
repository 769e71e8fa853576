// Small broken meshes, written here and those of the test data: each has the property that its name or EXPECTED.json states, by this
// program's own inspection.
#include "base/repair.hpp"
#include "base/self_intersection.hpp"
#include "base/topology.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/prepare/process.hpp"
#include "tests/made/hostile.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>

namespace trocar::engine {
namespace {

using Path = std::filesystem::path;

TriMesh mesh_of(const Path& file, bool weld = false) {
    Result<TriMesh> mesh = read_surface(file, {.weld = weld});
    EXPECT_TRUE(mesh.ok()) << mesh.error().to_string();
    return mesh.ok() ? std::move(*mesh) : TriMesh{};
}

void expect_refused(const Path& file, const std::string& why) {
    const Result<TriMesh> mesh = read_surface(file, {});
    ASSERT_FALSE(mesh.ok());
    EXPECT_NE(mesh.error().message.find(why), std::string::npos) << mesh.error().to_string();
}

/// Closed and manifold, wherever it stands and however large it is; winding and shells are checked separately.
void expect_sound(const SurfaceReport& report) {
    EXPECT_TRUE(report.closed() && report.manifold() && report.finite());
    EXPECT_TRUE(report.oriented());
}

TriMesh two_sound_parts(const Path& file) {
    TriMesh mesh = mesh_of(file);
    const SurfaceReport report = inspect_surface(mesh);
    expect_sound(report);
    EXPECT_EQ(report.components, 2u);
    return mesh;
}

/// Loops that the edges used by one triangle make, if two of them meet at every vertex of theirs; 0 otherwise.
std::size_t count_border_loops(const TriMesh& mesh) {
    std::map<Index, std::vector<Index>> next;
    const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.triangles);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 1) return;
        next[edge[0].lo].push_back(edge[0].hi);
        next[edge[0].hi].push_back(edge[0].lo);
    });
    for (const auto& [vertex, ends] : next)
        if (ends.size() != 2) return 0;
    std::size_t loops = 0;
    while (!next.empty()) {
        ++loops;
        std::vector<Index> open{next.begin()->first};
        while (!open.empty()) {
            const auto at = next.find(open.back());
            open.pop_back();
            if (at == next.end()) continue;
            open.insert(open.end(), at->second.begin(), at->second.end());
            next.erase(at);
        }
    }
    return loops;
}

/// Does a choice of which triangles to flip make every inner edge run both ways? Found by walking across edges.
bool can_be_oriented(const TriMesh& mesh) {
    struct Step {
        Index to;
        bool flips;
    };
    std::vector<std::vector<Step>> across(mesh.triangles.size());
    const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.triangles);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 2) return;
        const bool flips = edge[0].forward == edge[1].forward;
        across[edge[0].triangle].push_back({edge[1].triangle, flips});
        across[edge[1].triangle].push_back({edge[0].triangle, flips});
    });
    std::vector<int> flipped(mesh.triangles.size(), -1);
    for (Index first = 0; first < mesh.triangles.size(); ++first) {
        if (flipped[first] >= 0) continue;
        flipped[first] = 0;
        for (std::vector<Index> open{first}; !open.empty();) {
            const Index at = open.back();
            open.pop_back();
            for (const Step& step : across[at]) {
                const int wanted = flipped[at] ^ int(step.flips);
                if (flipped[step.to] >= 0 && flipped[step.to] != wanted) return false;
                if (flipped[step.to] < 0) open.push_back(step.to);
                flipped[step.to] = wanted;
            }
        }
    }
    return true;
}

using Check = std::function<void(const Path&)>;

const std::map<std::string, Check> kBroken = {
    {"cube_nan_vertex.obj", [](const Path& file) { expect_refused(file, "not finite"); }},
    {"cube_inf_vertex.obj", [](const Path& file) { expect_refused(file, "not finite"); }},
    {"index_out_of_range.obj", [](const Path& file) { expect_refused(file, "vertex index 100"); }},
    {"empty.obj", [](const Path& file) { expect_refused(file, "is empty"); }},
    {"cube_open_one_face.obj",
     [](const Path& file) {
         const SurfaceReport report = inspect_surface(mesh_of(file));
         EXPECT_FALSE(report.closed());
         EXPECT_EQ(report.boundary_edges, 4u);
     }},
    {"cube_flipped_face.obj",
     [](const Path& file) {
         const SurfaceReport report = inspect_surface(mesh_of(file));
         EXPECT_TRUE(report.closed() && report.manifold());
         EXPECT_EQ(report.inconsistent_edges, 3u);
     }},
    {"cube_duplicate_face.obj",
     [](const Path& file) {
         const SurfaceReport report = inspect_surface(mesh_of(file));
         EXPECT_EQ(report.duplicate_triangles, 1u);
         EXPECT_EQ(report.nonmanifold_edges, 3u);
     }},
    {"cube_duplicate_verts.obj",
     [](const Path& file) {
         EXPECT_EQ(mesh_of(file).vertices.size(), 36u);
         const TriMesh welded = mesh_of(file, true);
         EXPECT_EQ(welded.vertices.size(), 8u);
         expect_sound(inspect_surface(welded));
     }},
    {"cube_near_duplicate_verts.obj",
     [](const Path& file) {
         TriMesh mesh = mesh_of(file, true);
         EXPECT_FALSE(inspect_surface(mesh).closed()) << "equal coordinates alone do not join it";
         ASSERT_TRUE(apply_repair(mesh, Repair::Weld, {.weld_tolerance = 1e-7}).ok());
         EXPECT_EQ(mesh.vertices.size(), 8u);
         expect_sound(inspect_surface(mesh));
     }},
    {"degenerate_zero_area.obj", [](const Path& file) { EXPECT_EQ(inspect_surface(mesh_of(file)).degenerate_triangles, 2u); }},
    {"edge_three_faces.obj", [](const Path& file) { EXPECT_EQ(inspect_surface(mesh_of(file)).nonmanifold_edges, 1u); }},
    {"bowtie_vertex.obj",
     [](const Path& file) {
         const SurfaceReport report = inspect_surface(mesh_of(file));
         EXPECT_TRUE(report.closed());
         EXPECT_EQ(report.nonmanifold_edges, 0u);
         EXPECT_EQ(report.nonmanifold_vertices, 1u);
     }},
    {"two_spheres_interpenetrating.obj", [](const Path& file) { EXPECT_GT(find_self_intersections(two_sound_parts(file)).count, 0u); }},
    {"two_cubes_touching_face.obj",
     [](const Path& file) {
         const TriMesh mesh = two_sound_parts(file);
         EXPECT_EQ(find_self_intersections(mesh).count, 0u) << "nothing crosses";
         EXPECT_GT(find_self_intersections(mesh, 1000, Crossing::Touching).count, 0u);
     }},
    {"cube_huge_offset.obj",
     [](const Path& file) {
         const SurfaceReport report = inspect_surface(mesh_of(file));
         expect_sound(report);
         EXPECT_EQ(report.signed_volume, 1.0) << "doubles stand 1.5e-8 apart there";
     }},
    {"cube_tiny.obj",
     [](const Path& file) {
         const SurfaceReport report = inspect_surface(mesh_of(file));
         expect_sound(report);
         EXPECT_NEAR(report.signed_volume, 1e-27, 1e-39);
     }},
    {"sliver_strip.obj",
     [](const Path& file) {
         const TriMesh mesh = mesh_of(file);
         EXPECT_EQ(inspect_surface(mesh).degenerate_triangles, 0u) << "1e-12 high is an area";
         double lowest = 1.0;
         for (const Triangle& t : mesh.triangles) {
             const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
             const double base = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
             lowest = std::min(lowest, (b - a).cross(c - a).norm() / base);
         }
         EXPECT_NEAR(lowest, 1e-12, 1e-15);
     }},
    {"unreferenced_vertices.obj",
     [](const Path& file) {
         TriMesh mesh = mesh_of(file);
         EXPECT_EQ(inspect_surface(mesh).unreferenced_vertices, 2u);
         EXPECT_EQ(drop_unreferenced_vertices(mesh), 2u);
         expect_sound(inspect_surface(mesh));
     }},
    {"nonplanar_quad.obj",
     [](const Path& file) {
         const TriMesh mesh = mesh_of(file);
         EXPECT_EQ(mesh.vertices.size(), 5u);
         ASSERT_EQ(mesh.triangles.size(), 5u) << "a quad and a pentagon, as fans";
         EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2})) << "written as -5, -4, -3";
     }},
    {"mobius_strip.obj",
     [](const Path& file) {
         const TriMesh mesh = mesh_of(file);
         const SurfaceReport report = inspect_surface(mesh);
         EXPECT_FALSE(report.closed());
         EXPECT_TRUE(report.manifold());
         EXPECT_GT(report.inconsistent_edges, 0u);
         EXPECT_EQ(count_border_loops(mesh), 1u);
         EXPECT_FALSE(can_be_oriented(mesh));
     }},
    {"tet_inverted.vtk", [](const Path& file) { EXPECT_EQ(inspect_tets(*read_tets(file)).inverted_tets, 1u); }},
    {"tet_flat.vtk", [](const Path& file) { EXPECT_EQ(inspect_tets(*read_tets(file)).flat_tets, 1u); }},
};

TEST(Expected, EveryBrokenMeshWrittenHereHasTheStatedProperty) {
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    made::write_hostile_meshes(folder->path());
    for (const auto& [name, check] : kBroken) {
        SCOPED_TRACE(name);
        const Path file = folder->path() / "nasty/synthetic" / name;
        ASSERT_TRUE(std::filesystem::exists(file)) << "it is not written";
        check(file);
    }
    EXPECT_EQ(made::hostile_meshes().size(), kBroken.size()) << "a file that is written is checked nowhere";
}

TEST(Expected, EveryOddMeshWrittenHereIsReadOrRefusedWithASentence) {
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    made::write_hostile_meshes(folder->path());
    std::size_t read = 0, refused = 0;
    for (const auto& [name, bytes] : made::odd_meshes())
        for (const bool weld : {false, true}) {
            const Result<TriMesh> mesh = read_surface(folder->path() / "nasty" / name, {.weld = weld});
            (mesh.ok() ? read : refused) += 1;
            if (!mesh.ok()) {
                EXPECT_NE(mesh.error().to_string().find(name), std::string::npos) << mesh.error().to_string();
            }
            for (const Triangle& t : mesh.ok() ? mesh->triangles : std::vector<Triangle>{})
                for (const Index v : t) EXPECT_LT(v, mesh->vertices.size()) << name;
        }
    EXPECT_GT(read, 10u);
    EXPECT_GT(refused, 4u);
}

TEST(Expected, EveryBrokenMeshOfTheTestDataHasTheStatedProperty) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA does not name the test data";
    std::size_t lists = 0, meshes = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data)) {
        if (entry.path().filename() != "EXPECTED.json") continue;
        ++lists;
        std::ifstream in(entry.path());
        const nlohmann::json stated = nlohmann::json::parse(in, nullptr, false);
        ASSERT_TRUE(stated.is_object()) << entry.path();
        for (const auto& [file, words] : stated.items()) {
            SCOPED_TRACE(file + ": " + words.get<std::string>());
            const auto check = kBroken.find(file);
            ASSERT_NE(check, kBroken.end()) << "nothing here checks it";
            check->second(entry.path().parent_path() / file);
            ++meshes;
        }
    }
    EXPECT_GT(lists, 0u);
    EXPECT_EQ(meshes, kBroken.size()) << "a file that is checked is stated nowhere";
}

} // namespace
} // namespace trocar::engine
