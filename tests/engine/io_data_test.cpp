// The public test data: every mesh of the manifest has the counts that the manifest measured with another program.
#include "base/topology.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/weld.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>

namespace trocar::engine::test {
namespace {

std::filesystem::path data_folder() {
    const char* folder = std::getenv("TROCAR_TEST_DATA");
    return folder ? folder : "";
}

struct ManifestRow {
    std::string file, vertices, triangles, tets;
};

/// Rows of the manifest's tables: | `file` | V | F | T | ...
std::vector<ManifestRow> read_manifest() {
    std::vector<ManifestRow> rows;
    std::ifstream in(data_folder() / "MANIFEST.md");
    for (std::string line; std::getline(in, line);) {
        if (!line.starts_with("| `")) continue;
        std::istringstream cells(line);
        std::string cell;
        std::vector<std::string> fields;
        while (fields.size() < 5 && std::getline(cells, cell, '|')) {
            const std::size_t first = cell.find_first_not_of(" `");
            fields.push_back(first == cell.npos ? "" : cell.substr(first, cell.find_last_not_of(" `") - first + 1));
        }
        rows.push_back({fields[1], fields[2], fields[3], fields[4]});
    }
    return rows;
}

bool is_surface_file(const std::string& file) {
    for (const char* extension : {".obj", ".ply", ".stl", ".STL", ".off"})
        if (file.find(extension) != file.npos) return true;
    return file.ends_with("sofa_liver_10k.vtk.gz");
}

bool is_tets_file(const std::string& file) {
    if (is_surface_file(file)) return false;
    for (const char* extension : {".msh", ".vtu", ".mesh", ".vtk", ".ele", "_tet.veg"})
        if (file.find(extension) != file.npos) return true;
    return false;
}

/// Files that must be refused, with a part of the sentence that says why.
const std::map<std::string, std::string> kRefused = {
    {"nasty/synthetic/cube_nan_vertex.obj", "not finite"},
    {"nasty/synthetic/cube_inf_vertex.obj", "not finite"},
    {"nasty/synthetic/index_out_of_range.obj", "vertex index 100"},
    {"nasty/synthetic/empty.obj", "is empty"},
};

/// Vertices where they differ from the manifest, which joins what is nearer than 1e-12: here one pair.
const std::map<std::string, std::string> kExactVertices = {{"nasty/manifoldlib_openscad-nonmanifold-crash.obj.gz", "658"}};

/// The tetrahedra of this file fill the convex hull; the manifest counts the triangles that it lists beside them.
const std::string kHullMesh = "stanford/bunny_tet34k.mesh.gz";

class TestData : public testing::Test {
protected:
    void SetUp() override {
        if (data_folder().empty()) GTEST_SKIP() << "TROCAR_TEST_DATA does not name the test data";
        ASSERT_GT(read_manifest().size(), 60u);
    }
};

TEST_F(TestData, EverySurfaceHasTheCountsOfTheManifest) {
    std::size_t read = 0;
    for (const ManifestRow& row : read_manifest()) {
        if (!is_surface_file(row.file)) continue;
        SCOPED_TRACE(row.file);
        const auto start = std::chrono::steady_clock::now();
        Result<TriMesh> mesh = read_surface(data_folder() / row.file, {.weld = true});
        const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        if (kRefused.contains(row.file)) {
            ASSERT_FALSE(mesh.ok());
            EXPECT_NE(mesh.error().message.find(kRefused.at(row.file)), std::string::npos) << mesh.error().to_string();
            continue;
        }
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        ++read;
        if (mesh->triangles.size() > 80000) std::cout << row.file << ": " << mesh->triangles.size() << " triangles in " << ms << " ms\n";
        if (row.vertices.empty()) continue; // the other program could not read it
        EXPECT_EQ(std::to_string(mesh->vertices.size()), kExactVertices.contains(row.file) ? kExactVertices.at(row.file) : row.vertices);
        EXPECT_EQ(std::to_string(mesh->triangles.size()), row.triangles);
    }
    EXPECT_GT(read, 60u);
}

TEST_F(TestData, EveryTetMeshHasTheCountsOfTheManifest) {
    std::size_t read = 0;
    for (const ManifestRow& row : read_manifest()) {
        if (!is_tets_file(row.file)) continue;
        SCOPED_TRACE(row.file);
        const Result<TetMesh> mesh = read_tets(data_folder() / row.file);
        if (kRefused.contains(row.file)) {
            ASSERT_FALSE(mesh.ok());
            EXPECT_NE(mesh.error().message.find(kRefused.at(row.file)), std::string::npos) << mesh.error().to_string();
            continue;
        }
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        ++read;
        if (row.tets.empty()) continue;
        if (row.tets.starts_with("hex")) { // hexahedra, split: the manifest has no boundary of theirs
            EXPECT_EQ(mesh->tets.size(), 6 * std::stoul(row.tets.substr(3)));
            EXPECT_TRUE(inspect_tets(*mesh).valid());
            EXPECT_TRUE(inspect_surface(boundary_surface(*mesh)).closed());
            continue;
        }
        EXPECT_EQ(std::to_string(mesh->tets.size()), row.tets);
        if (row.file == kHullMesh) continue;
        TriMesh boundary = boundary_surface(*mesh);
        weld_equal_vertices(boundary);
        drop_unreferenced_vertices(boundary);
        EXPECT_EQ(std::to_string(boundary.triangles.size()), row.triangles);
        EXPECT_EQ(std::to_string(boundary.vertices.size()), row.vertices);
    }
    EXPECT_GT(read, 14u);
}

TEST_F(TestData, ABackslashContinuesAFace) {
    const Result<TriMesh> mesh = read_surface(data_folder() / "nasty/trimesh_wallhole.obj", {.weld = true});
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_GT(mesh->triangles.size(), 20u);
}

TEST_F(TestData, InvertedAndFlatTetrahedraAreKeptForTheReport) {
    EXPECT_EQ(inspect_tets(*read_tets(data_folder() / "nasty/synthetic/tet_inverted.vtk")).inverted_tets, 1u);
    EXPECT_EQ(inspect_tets(*read_tets(data_folder() / "nasty/synthetic/tet_flat.vtk")).flat_tets, 1u);
}

TEST_F(TestData, AnArteryIsTakenFromTheTreeByName) {
    const std::filesystem::path path = data_folder() / "vessels/hra_vhf_arteries_101k.obj.gz";
    const Result<std::vector<std::string>> groups = read_surface_groups(path);
    ASSERT_TRUE(groups.ok());
    EXPECT_EQ(groups->size(), 37u);
    const Result<TriMesh> part = read_surface(path, {.groups = {"VHF_celiac_artery", "VHF_splenic_artery"}});
    ASSERT_TRUE(part.ok()) << part.error().to_string();
    EXPECT_GT(part->triangles.size(), 1000u);
    EXPECT_LT(part->triangles.size(), 50000u);
    EXPECT_EQ(inspect_surface(*part).unreferenced_vertices, 0u);
}

} // namespace
} // namespace trocar::engine::test
