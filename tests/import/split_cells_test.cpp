// Hexahedra, prisms and pyramids of a file become tetrahedra that fit: of the same volume, with one closed boundary, whatever their nodes are
// numbered like and whichever way their corners are counted.
#include "base/topology.hpp"
#include "engine/importing/import_organ.hpp"
#include "engine/io/read_tets.hpp"
#include "tests/temp_folder.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace trocar::engine::test {
namespace {

using SplitCellsTest = trocar::FolderTest;

constexpr double kSide = 3.0; // of a grid's cells, in each direction

struct Grid {
    TetMesh mesh; // vertices, and some of the cells
    MixedCells cells;
};

/// Cells of a cube, each left whole, cut into two prisms or into six pyramids, its nodes numbered at random and moved a little.
/// turned   corners are counted the other way
Grid make_grid(std::mt19937& random, bool turned) {
    constexpr int kCells = 3, kNodes = kCells + 1;
    std::vector<Index> id(kNodes * kNodes * kNodes);
    std::iota(id.begin(), id.end(), Index{0});
    std::shuffle(id.begin(), id.end(), random);
    std::uniform_real_distribution<double> shift(-0.1, 0.1);
    Grid grid;
    grid.mesh.vertices.resize(id.size());
    const auto node = [&](int x, int y, int z) { return id[static_cast<std::size_t>((z * kNodes + y) * kNodes + x)]; };
    const auto inner = [&](int at) { return at > 0 && at < kCells ? shift(random) : 0.0; };
    for (int z = 0; z < kNodes; ++z)
        for (int y = 0; y < kNodes; ++y)
            for (int x = 0; x < kNodes; ++x) grid.mesh.vertices[node(x, y, z)] = Vec3(x + inner(x), y + inner(y), z + inner(z));
    for (int z = 0; z < kCells; ++z)
        for (int y = 0; y < kCells; ++y)
            for (int x = 0; x < kCells; ++x) {
                std::array<Index, 8> c{node(x, y, z),     node(x + 1, y, z),     node(x + 1, y + 1, z),     node(x, y + 1, z),
                                       node(x, y, z + 1), node(x + 1, y, z + 1), node(x + 1, y + 1, z + 1), node(x, y + 1, z + 1)};
                if (turned) std::swap_ranges(c.begin(), c.begin() + 4, c.begin() + 4);
                const bool pillar = x == 1 && y == 1; // a prism's ends are cut by its own diagonal: those of a pillar meet one another
                if (pillar) {
                    grid.cells.prisms.push_back({c[0], c[1], c[2], c[4], c[5], c[6]});
                    grid.cells.prisms.push_back({c[0], c[2], c[3], c[4], c[6], c[7]});
                } else if (random() % 2 == 0) {
                    const auto middle = static_cast<Index>(grid.mesh.vertices.size());
                    Vec3 sum = Vec3::Zero();
                    for (const Index v : c) sum += grid.mesh.vertices[v];
                    grid.mesh.vertices.push_back(sum / 8.0);
                    const std::array<std::array<int, 4>, 6> sides{{{0, 1, 2, 3}, {4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}}};
                    for (const auto& s : sides) // seen from the middle
                        grid.cells.pyramids.push_back({c[std::size_t(s[0])], c[std::size_t(s[1])], c[std::size_t(s[2])], c[std::size_t(s[3])], middle});
                } else {
                    grid.cells.hexahedra.push_back(c);
                }
            }
    return grid;
}

TEST(SplitCells, TetrahedraFitOneAnotherWhateverTheNodesAreNumberedLike) {
    std::mt19937 random(5);
    for (int round = 0; round < 60; ++round) {
        const bool turned = round % 2 == 1;
        SCOPED_TRACE(round);
        Grid grid = make_grid(random, turned);
        BesideTets beside;
        const TetMesh mesh = join_cells(std::move(grid.mesh), grid.cells, &beside);
        const SplitCells& split = beside.split;
        const TetMeshReport report = inspect_tets(mesh);
        EXPECT_TRUE(report.valid());
        EXPECT_EQ(report.inverted_tets + report.flat_tets + report.overused_faces + report.duplicate_tets, 0U);
        EXPECT_EQ(report.components, 1U);
        EXPECT_NEAR(report.volume, kSide * kSide * kSide, 1e-9);
        EXPECT_EQ(split.tets, 6 * split.hexahedra + 3 * split.prisms + 2 * split.pyramids);
        EXPECT_EQ(split.tets, mesh.tets.size());
        const SurfaceReport surface = inspect_surface(boundary_surface(mesh));
        EXPECT_TRUE(surface.closed() && surface.manifold() && surface.oriented());
        EXPECT_NEAR(surface.signed_volume, kSide * kSide * kSide, 1e-9);
    }
}

TEST(SplitCells, ACellWhoseCornersCoincideGivesFewerTetrahedra) {
    TetMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}};
    MixedCells cells;
    cells.hexahedra.push_back({0, 1, 2, 3, 4, 5, 5, 4}); // a roof
    const TetMesh roof = join_cells(std::move(mesh), cells, nullptr);
    const TetMeshReport report = inspect_tets(roof);
    EXPECT_TRUE(report.valid());
    EXPECT_NEAR(report.volume, 0.5, 1e-15);
}

TEST_F(SplitCellsTest, EveryFormatsCubeIsTheUnitCube) {
    const std::string nodes_msh = "0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n";
    const std::string points = "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1";
    const auto vtu = [&](const std::string& connectivity, int corners, int type) {
        return fmt::format("<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"8\" NumberOfCells=\"1\"><Points>"
                           "<DataArray type=\"Float64\" format=\"ascii\">{}</DataArray></Points><Cells>"
                           "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">{}</DataArray>"
                           "<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">{}</DataArray>"
                           "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">{}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>",
                           points, connectivity, corners, type);
    };
    const std::string medit = "MeshVersionFormatted 1\nDimension 3\nVertices\n8\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n1 1 1 0\n0 1 1 0\n";
    const std::string msh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n1 " + nodes_msh + "$EndNodes\n$Elements\n";
    struct Case {
        const char* name;
        std::string text;
        std::size_t hexahedra, prisms, pyramids;
    };
    const std::vector<Case> cases{
        {"cube.msh", msh + "1\n1 5 2 0 1 1 2 3 4 5 6 7 8\n$EndElements\n", 1, 0, 0},
        {"prisms.msh", msh + "2\n1 6 2 0 1 1 2 3 5 6 7\n2 6 2 0 1 1 3 4 5 7 8\n$EndElements\n", 0, 2, 0},
        {"pyramids.msh", msh + "3\n1 7 2 0 1 1 4 3 2 5\n2 7 2 0 1 2 3 7 6 5\n3 7 2 0 1 3 4 8 7 5\n$EndElements\n", 0, 0, 3},
        {"cube.mesh", medit + "Hexahedra\n1\n1 2 3 4 5 6 7 8 0\nEnd\n", 1, 0, 0},
        {"prisms.mesh", medit + "Prisms\n2\n1 2 3 5 6 7 0\n1 3 4 5 7 8 0\nEnd\n", 0, 2, 0},
        {"cube.vtu", vtu("0 1 2 3 4 5 6 7", 8, 12), 1, 0, 0},
        {"voxel.vtu", vtu("0 1 3 2 4 5 7 6", 8, 11), 1, 0, 0},
        {"cube.vtk", "# vtk DataFile Version 3.0\ncube\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n" + points +
                         "\nCELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n", 1, 0, 0},
        {"cube.veg", "*VERTICES\n8 3 0 0\n1 " + nodes_msh + "*ELEMENTS\nCUBIC\n1 8 0\n1 1 2 3 4 5 6 7 8\n", 1, 0, 0},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        BesideTets beside;
        const Result<TetMesh> mesh = read_tets(write(c.name, c.text), &beside);
        const SplitCells& split = beside.split;
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        const TetMeshReport report = inspect_tets(*mesh);
        EXPECT_TRUE(report.valid());
        EXPECT_NEAR(report.volume, 1.0, 1e-15);
        EXPECT_EQ(split.hexahedra, c.hexahedra);
        EXPECT_EQ(split.prisms, c.prisms);
        EXPECT_EQ(split.pyramids, c.pyramids);
    }
}

TEST_F(SplitCellsTest, AnImportedOrganSaysWhatWasSplit) {
    const std::filesystem::path file = write("cube.mesh", "MeshVersionFormatted 1\nDimension 3\nVertices\n9\n0 0 0 0\n50 0 0 0\n50 50 0 0\n0 50 0 0\n0 0 50 0\n50 0 50 0\n"
                                            "50 50 50 0\n0 50 50 0\n25 25 80 0\nHexahedra\n1\n1 2 3 4 5 6 7 8 0\nPyramids\n1\n5 6 7 8 9 0\nEnd\n");
    Result<OrganInput> input = read_organ(file);
    ASSERT_TRUE(input.ok()) << input.error().to_string();
    EXPECT_EQ(input->split, "1 hexahedron, 1 pyramid split into 8 tetrahedra");
    const Result<ImportedOrgan> organ = import_organ(std::move(*input), 1e-3, MendMode::Automatic, {});
    ASSERT_TRUE(organ.ok()) << organ.error().to_string();
    EXPECT_EQ(organ->quality.front(), "1 hexahedron, 1 pyramid split into 8 tetrahedra");
    EXPECT_NEAR(1e9 * signed_volume(organ->surface), 50.0 * 50.0 * 50.0 + 50.0 * 50.0 * 30.0 / 3.0, 1e-6);
}

TEST_F(SplitCellsTest, CellsWhoseCornersAllCoincideAreNoMesh) {
    const Result<TetMesh> mesh = read_tets(write("point.mesh", "MeshVersionFormatted 1\nDimension 3\nVertices\n1\n0 0 0 0\nHexahedra\n1\n1 1 1 1 1 1 1 1 0\nEnd\n"));
    ASSERT_FALSE(mesh.ok());
    EXPECT_NE(mesh.error().to_string().find("none of four corners or more that differ"), std::string::npos) << mesh.error().to_string();
}

TEST_F(SplitCellsTest, CornersThatAreNotThereAreRefusedWithTheirCell) {
    const std::filesystem::path file = write("bad.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 5 2 0 1 1 1 1 1 1 1 1 9\n$EndElements\n");
    const Result<TetMesh> mesh = read_tets(file);
    ASSERT_FALSE(mesh.ok());
    EXPECT_NE(mesh.error().to_string().find("a hexahedron uses node 9"), std::string::npos) << mesh.error().to_string();
    EXPECT_EQ(mesh.error().line, 10U);
}

} // namespace
} // namespace trocar::engine::test
