// Regions by the cell data of every format of tetrahedra: the same two labels, whatever the file calls them, text or binary; what is damaged is
// refused; an organ that is imported has them in its scene.
#include "engine/importing/import_organ.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/write_mesh.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/prepare/tissue_regions.hpp"
#include "engine/scene/scene.hpp"
#include "engine/step/model_hash.hpp"
#include "tests/engine/io_bytes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace trocar::engine::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using CellArrays = trocar::FolderTest;
using Names = std::map<std::int64_t, std::string>;

// Two tetrahedra on one face, 10 and 20 mm high, labels 3 and 7.
const std::vector<Vec3> kPoints{{0, 0, 0}, {30, 0, 0}, {0, 30, 0}, {0, 0, 10}, {0, 0, -20}};
constexpr std::array<Tet, 2> kTets{{{0, 1, 2, 3}, {0, 2, 1, 4}}};
constexpr std::array<int, 2> kLabels{3, 7};

std::string rows_of_points(bool numbered, const std::string& end = "") {
    std::string text;
    for (std::size_t k = 0; k < kPoints.size(); ++k)
        text += fmt::format("{}{} {} {}{}\n", numbered ? std::to_string(k + 1) + " " : "", kPoints[k].x(), kPoints[k].y(), kPoints[k].z(), end);
    return text;
}
std::string corners(std::size_t t, int first) {
    return fmt::format("{} {} {} {}", int(kTets[t][0]) + first, int(kTets[t][1]) + first, int(kTets[t][2]) + first, int(kTets[t][3]) + first);
}

std::string msh2(bool binary) {
    std::string text = fmt::format("$MeshFormat\n2.2 {} 8\n", binary ? 1 : 0);
    if (binary) put<std::int32_t>(text, 1), text += "\n";
    text += "$EndMeshFormat\n$PhysicalNames\n3\n2 3 \"wall\"\n3 3 \"right lobe\"\n3 7 \"tumour\"\n$EndPhysicalNames\n$Nodes\n5\n";
    if (binary)
        for (std::int32_t k = 0; k < 5; ++k) {
            put<std::int32_t>(text, k + 1);
            for (int axis = 0; axis < 3; ++axis) put<double>(text, kPoints[static_cast<std::size_t>(k)][axis]);
        }
    else
        text += rows_of_points(true);
    text += fmt::format("{}$EndNodes\n$Elements\n{}\n", binary ? "\n" : "", binary ? 2 : 3);
    if (!binary) return text + fmt::format("1 2 2 99 1 1 2 3\n2 4 2 3 11 {}\n3 4 2 7 12 {}\n$EndElements\n", corners(0, 1), corners(1, 1));
    for (const std::int32_t head : {4, 2, 2}) put(text, head);
    for (std::size_t t = 0; t < 2; ++t) {
        for (const std::int32_t tag : {std::int32_t(t + 1), std::int32_t(kLabels[t]), std::int32_t(11 + t)}) put(text, tag);
        for (const Index corner : kTets[t]) put<std::int32_t>(text, static_cast<std::int32_t>(corner) + 1);
    }
    return text + "\n$EndElements\n";
}

std::string msh4() {
    return "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 3 \"right lobe\"\n3 7 \"tumour\"\n$EndPhysicalNames\n"
           "$Entities\n1 1 1 2\n1 0 0 0 0\n1 0 0 0 30 0 0 0 2 1 1\n1 0 0 0 30 30 0 1 99 1 1\n41 0 0 0 30 30 10 1 3 1 1\n42 0 0 -20 30 30 0 2 7 3 1 -1\n$EndEntities\n"
           "$Nodes\n1 5 1 5\n3 41 0 5\n1\n2\n3\n4\n5\n" +
           rows_of_points(false) + fmt::format("$EndNodes\n$Elements\n2 2 1 2\n3 41 4 1\n1 {}\n3 42 4 1\n2 {}\n$EndElements\n", corners(0, 1), corners(1, 1));
}

std::string msh4_binary() {
    std::string text = "$MeshFormat\n4.1 1 8\n";
    put<std::int32_t>(text, 1);
    text += "\n$EndMeshFormat\n$PhysicalNames\n2\n3 3 \"right lobe\"\n3 7 \"tumour\"\n$EndPhysicalNames\n$Entities\n";
    for (const std::uint64_t count : {0, 0, 0, 2}) put(text, count);
    for (std::size_t t = 0; t < 2; ++t) {
        put<std::int32_t>(text, static_cast<std::int32_t>(41 + t));
        for (int k = 0; k < 6; ++k) put<double>(text, 1.0);
        put<std::uint64_t>(text, 1), put<std::int32_t>(text, kLabels[t]), put<std::uint64_t>(text, 0);
    }
    text += "\n$EndEntities\n$Nodes\n";
    for (const std::uint64_t count : {1, 5, 1, 5}) put(text, count);
    for (const std::int32_t head : {3, 41, 0}) put(text, head);
    put<std::uint64_t>(text, 5);
    for (std::uint64_t k = 1; k <= 5; ++k) put(text, k);
    for (const Vec3& x : kPoints)
        for (int axis = 0; axis < 3; ++axis) put<double>(text, x[axis]);
    text += "\n$EndNodes\n$Elements\n";
    for (const std::uint64_t count : {2, 2, 1, 2}) put(text, count);
    for (std::size_t t = 0; t < 2; ++t) {
        for (const std::int32_t head : {3, std::int32_t(41 + t), 4}) put(text, head);
        put<std::uint64_t>(text, 1), put<std::uint64_t>(text, t + 1);
        for (const Index corner : kTets[t]) put<std::uint64_t>(text, corner + 1);
    }
    return text + "\n$EndElements\n";
}

const std::string kMsh1Elements = "2\n1 4 3 11 4 1 2 3 4\n2 4 7 12 4 1 3 2 5\n";

/// cells  a section of CELL_DATA
std::string vtk(const std::string& cells) {
    return "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n" + rows_of_points(false) +
           fmt::format("CELLS 3 14\n3 0 1 2\n4 {}\n4 {}\nCELL_TYPES 3\n5\n10\n10\n", corners(0, 0), corners(1, 0)) + cells;
}
const std::string kScalars = "CELL_DATA 3\nVECTORS flow float\n1 2 3 4 5 6 7 8 9\nSCALARS part int 1\nLOOKUP_TABLE default\n99 3 7\n";

std::string vtk_binary() {
    std::string text = "# vtk DataFile Version 3.0\ntwo\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n";
    for (const Vec3& x : kPoints)
        for (int axis = 0; axis < 3; ++axis) put<double>(text, x[axis], true);
    text += "\nCELLS 2 10\n";
    for (const Tet& t : kTets) {
        put<std::int32_t>(text, 4, true);
        for (const Index corner : t) put<std::int32_t>(text, static_cast<std::int32_t>(corner), true);
    }
    text += "\nCELL_TYPES 2\n";
    for (int k = 0; k < 2; ++k) put<std::int32_t>(text, 10, true);
    text += "\nPOINT_DATA 5\nSCALARS region int\nLOOKUP_TABLE default\n";
    for (int k = 0; k < 5; ++k) put<std::int32_t>(text, 1, true);
    text += "\nCELL_DATA 2\nFIELD FieldData 2\nwarp 3 2 float\n";
    for (int k = 0; k < 6; ++k) put<float>(text, 0.5F, true);
    text += "\nMETADATA\nINFORMATION 0\n\nMaterialIds 1 2 vtktypeint64\n";
    for (const int label : kLabels) put<std::int64_t>(text, label, true);
    return text + "\n";
}

std::string vtu(const std::string& cell_data) {
    return fmt::format("<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"5\" NumberOfCells=\"2\"><Points>"
                       "<DataArray type=\"Float64\" format=\"ascii\">{}</DataArray></Points><Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">{} {}</DataArray>"
                       "<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4 8</DataArray><DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 10</DataArray></Cells>"
                       "<CellData>{}</CellData></Piece></UnstructuredGrid></VTKFile>",
                       rows_of_points(false), corners(0, 0), corners(1, 0), cell_data);
}
std::string array_of(const std::string& name, const std::string& type, const std::string& values) {
    return fmt::format("<DataArray type=\"{}\" Name=\"{}\" format=\"ascii\">{}</DataArray>", type, name, values);
}

std::string medit() {
    return "MeshVersionFormatted 1\nDimension 3\nVertices\n5\n" + rows_of_points(false, " 0") + "Triangles\n1\n1 2 3 99\n" +
           fmt::format("Tetrahedra\n2\n{} 3\n{} 7\nEnd\n", corners(0, 1), corners(1, 1));
}

std::string veg(const std::string& sets) {
    return "*VERTICES\n5 3 0 0\n" + rows_of_points(true) + fmt::format("*ELEMENTS\nTET\n2 4 0\n1 {}\n2 {}\n", corners(0, 1), corners(1, 1)) + sets;
}
const std::string kSets = "*MATERIAL SOFT\nENU, 1000, 1e4, 0.45\n*SET tumour\n2,\n*SET rest\n 1, \n*REGION\nrest, SOFT\n*REGION\ntumour, SOFT\n";

TEST_F(CellArrays, OfEveryFormatGiveEachTetrahedronTheLabelOfItsCell) {
    const Names named{{3, "right lobe"}, {7, "tumour"}};
    struct Case {
        const char* name;
        std::string text, array;
        Names names = {};
        std::array<std::int64_t, 2> labels{3, 7};
    };
    const std::vector<Case> cases{
        {"one.msh", "$NOD\n5\n" + rows_of_points(true) + "$ENDNOD\n$ELM\n" + kMsh1Elements + "$ENDELM\n", "gmsh:physical"},
        {"two.msh", msh2(false), "gmsh:physical", named},
        {"two_binary.msh", msh2(true), "gmsh:physical", named},
        {"four.msh", msh4(), "gmsh:physical", named},
        {"four_binary.msh", msh4_binary(), "gmsh:physical", named},
        {"scalars.vtk", vtk(kScalars), "part"},
        {"field.vtk", vtk_binary(), "MaterialIds"},
        {"a.vtu", vtu(array_of("quality", "Float64", "0.5 0.7") + array_of("RegionId", "Int32", "3 7")), "RegionId"},
        {"a.mesh", medit(), "medit:ref"},
        {"a.veg", veg(kSets), "vega:region", {{1, "rest"}, {2, "tumour"}}, {1, 2}},
        {"all.veg", veg("*SET tumour\n2\n*REGION\nallElements, A\n*REGION\ntumour, B\n"), "vega:region", {{1, "allElements"}, {2, "tumour"}}, {1, 2}},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        BesideTets beside;
        beside.with_arrays = true;
        const Result<TetMesh> mesh = read_tets(write(c.name, c.text), &beside);
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        ASSERT_EQ(mesh->tets.size(), 2u);
        const Result<TetLabels> labels = find_tet_labels(beside);
        ASSERT_TRUE(labels.ok()) << labels.error().to_string();
        EXPECT_EQ(labels->array, c.array);
        EXPECT_EQ(labels->names, c.names);
        EXPECT_EQ(labels->of_tet, (std::vector<std::int64_t>(c.labels.begin(), c.labels.end())));
        BesideTets none;
        ASSERT_TRUE(read_tets(folder / c.name, &none).ok());
        EXPECT_TRUE(none.arrays.empty()) << "arrays that nobody asks for are not read";
    }
    write("t.node", "5 3 0 0\n" + rows_of_points(true));
    BesideTets beside;
    beside.with_arrays = true;
    ASSERT_TRUE(read_tets(write("t.ele", fmt::format("2 4 1\n1 {} 3\n2 {} 7\n", corners(0, 1), corners(1, 1))), &beside).ok());
    EXPECT_EQ(find_tet_labels(beside)->array, "tetgen:ref");
    EXPECT_EQ(find_tet_labels(beside)->of_tet, (std::vector<std::int64_t>{3, 7}));
}

TEST_F(CellArrays, ElementaryEntitiesTellRegionsApartWhereThereAreNoPhysicalGroups) {
    std::string text = msh2(false);
    for (const char* physical : {"4 2 3 11", "4 2 7 12"}) text.replace(text.find(physical) + 4, 1, "0");
    text.replace(text.find("2 2 99"), 6, "2 2 0 ");
    BesideTets beside;
    beside.with_arrays = true;
    ASSERT_TRUE(read_tets(write("a.msh", text), &beside).ok());
    const Result<TetLabels> labels = find_tet_labels(beside);
    ASSERT_TRUE(labels.ok()) << labels.error().to_string();
    EXPECT_EQ(labels->array, "gmsh:geometrical");
    EXPECT_EQ(labels->of_tet, (std::vector<std::int64_t>{11, 12}));
}

TEST_F(CellArrays, PassTheLabelOfASplitCellOnToItsTetrahedra) {
    const std::string nodes = "1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n9 0.5 0.5 2\n";
    BesideTets beside;
    beside.with_arrays = true;
    const Result<TetMesh> mesh = read_tets(write("mixed.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n9\n" + nodes +
                                                                  "$EndNodes\n$Elements\n2\n1 7 2 4 1 5 6 7 8 9\n2 5 2 6 1 1 2 3 4 5 6 7 8\n$EndElements\n"),
                                           &beside);
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    const Result<TetLabels> labels = find_tet_labels(beside);
    ASSERT_TRUE(labels.ok()) << labels.error().to_string();
    ASSERT_EQ(labels->of_tet.size(), mesh->tets.size());
    for (std::size_t t = 0; t < mesh->tets.size(); ++t) {
        const bool peak = std::find(mesh->tets[t].begin(), mesh->tets[t].end(), Index{8}) != mesh->tets[t].end();
        EXPECT_EQ(labels->of_tet[t], peak ? 4 : 6);
    }
}

TEST_F(CellArrays, ThatAreDamagedAreRefusedWhereTheyAreAskedForAndDoNoHarmElsewhere) {
    struct Case {
        const char* name;
        std::string text, message;
    };
    const std::vector<Case> cases{
        {"short.msh", msh4().substr(0, msh4().find("42 0 0 -20")) + "$EndEntities\n", "is not an integer where the entity's tag should stand"},
        {"huge.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 4000000000000\n$EndEntities\n", "but only"},
        {"names.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n4000000000000\n$EndPhysicalNames\n", "but only"},
        {"word.vtk", vtk("CELL_DATA 3\nSCALARS part int 1\nLOOKUP_TABLE default\n99 three 7\n"), "'three' is not a number"},
        {"few.vtk", vtk("CELL_DATA 3\nSCALARS part int 1\nLOOKUP_TABLE default\n99\n"), "the file ends"},
        {"kind.vtk", vtk("CELL_DATA 3\nNONSENSE part int\n1 2 3\n"), "'NONSENSE' is no array"},
        {"table.vtk", vtk("CELL_DATA 3\nSCALARS part int 1\n99 3 7\n"), "LOOKUP_TABLE should stand here"},
        {"huge.vtk", vtk("CELL_DATA 4000000000000\nSCALARS part int 1\nLOOKUP_TABLE default\n99 3 7\n"), "but only"},
        {"word.vtu", vtu(array_of("region", "Int32", "3 seven")), "'seven' is not a number"},
        {"set.veg", veg("*SET a\n1, 2, 3\n*REGION\na, X\n"), "the set a names the element '3', which is not given"},
        {"word.veg", veg("*SET a\n1, x\n*REGION\na, X\n"), "the set a names the element 'x', which is not given"},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        BesideTets beside;
        beside.with_arrays = true;
        const Result<TetMesh> mesh = read_tets(write(c.name, c.text), &beside);
        ASSERT_FALSE(mesh.ok());
        EXPECT_THAT(mesh.error().to_string(), HasSubstr(c.message));
        EXPECT_GT(mesh.error().line, 1u) << mesh.error().to_string();
    }
    EXPECT_TRUE(read_tets(folder / "word.vtk").ok());
    EXPECT_TRUE(read_tets(folder / "word.vtu").ok());
    BesideTets beside;
    beside.with_arrays = true;
    ASSERT_TRUE(read_tets(write("length.vtu", vtu(array_of("region", "Int32", "3"))), &beside).ok());
    EXPECT_THAT(find_tet_labels(beside, "region").error().message, HasSubstr("\"region\" has 1 values, and the file has cell 1; expected one for each cell"));
    ASSERT_TRUE(read_tets(write("two.vtu", vtu(array_of("one", "Int32", "3 4") + array_of("other", "Int32", "4 3"))), &beside).ok());
    EXPECT_THAT(find_tet_labels(beside).error().message, HasSubstr("none of the cell arrays one, other is known to say"));
    EXPECT_EQ(find_tet_labels(beside, "other")->of_tet, (std::vector<std::int64_t>{4, 3}));
    ASSERT_TRUE(read_tets(write("numbers.vtu", vtu(array_of("whatever", "UInt8", "3 7"))), &beside).ok());
    EXPECT_FALSE(find_tet_labels(beside).ok()) << "a number for each cell is no region";
    ASSERT_TRUE(read_tets(folder / "two.vtu", &beside).ok());
    EXPECT_THAT(find_tet_labels(beside, "othre").error().message, HasSubstr("nearest known cell array: \"other\""));
}

/// A file's fields are of no use to an organ without them: they must not keep its tetrahedra from being read.
TEST_F(CellArrays, ThatCannotBeReadAreLeftOutOfAnOrganWithANoteUnlessOneIsNamed) {
    const auto with = [](std::string text, const std::string& from, const std::string& to) { return text.replace(text.find(from), from.size(), to); };
    struct Case {
        const char* name;
        std::string text, message;
    };
    const std::vector<Case> cases{
        {"string.vtk", vtk(kScalars + "FIELD FieldData 1\nnames 1 3 string\na b c\n"), ":26: type 'string' is not read"},
        {"bit.vtk", vtk(kScalars + "SCALARS wall bit\nLOOKUP_TABLE default\n1 0 0\n"), "type 'bit' is not read"},
        {"table.vtk", vtk("CELL_DATA 3\nSCALARS part int 1\n99 3 7\n"), "LOOKUP_TABLE should stand here"},
        {"kind.vtk", vtk("CELL_DATA 3\nNONSENSE part int\n1 2 3\n"), "'NONSENSE' is no array"},
        {"word.vtu", vtu(array_of("region", "Int32", "3 seven")), "'seven' is not a number"},
        {"entities.msh", with(msh4(), "42 0 0 -20", "tumour 0 0 -20"), "'tumour' is not an integer where the entity's tag should stand"},
        {"names.msh", with(msh4(), "$PhysicalNames\n2", "$PhysicalNames\n4000000000000"), "but only"},
        {"set.veg", veg("*SET a\n1, 2, 3\n*REGION\na, X\n"), "the set a names the element '3', which is not given"},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        const Result<OrganInput> input = read_organ(write(c.name, c.text));
        ASSERT_TRUE(input.ok()) << input.error().to_string();
        ASSERT_TRUE(input->tets.has_value()) << "its surface was read instead";
        EXPECT_EQ(input->tets->tets.size(), 2u);
        EXPECT_TRUE(input->labels.of_tet.empty());
        EXPECT_THAT(input->labels_note, AllOf(HasSubstr("the cell arrays are left out"), HasSubstr(c.name), HasSubstr(c.message)));
        const Result<OrganInput> named = read_organ(folder / c.name, "part");
        ASSERT_FALSE(named.ok());
        EXPECT_THAT(named.error().to_string(), AllOf(HasSubstr(c.name), HasSubstr(c.message)));
    }
    const std::string three = "# vtk DataFile Version 3.0\none\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n0 0 0 1 0 0 0 1 0\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n10\n";
    EXPECT_THAT(read_organ(write("three.vtk", three)).error().to_string(), HasSubstr("as tetrahedra: cell 0 of type 10 has 3 corners, expected 4"));
    EXPECT_THAT(read_organ(folder / "three.vtk", "part").error().to_string(), HasSubstr("three.vtk: cell 0 of type 10 has 3 corners, expected 4"));
}

TEST_F(CellArrays, ThatNumberTheirCellsAreNoRegionsEvenWhereTheyAreNamed) {
    TetMesh mesh;
    std::vector<double> ids;
    for (Index t = 0; t < 257; ++t) {
        for (int k = 0; k < 4; ++k) mesh.vertices.push_back(kPoints[static_cast<std::size_t>(k)] + Vec3(40.0 * t, 0, 0));
        mesh.tets.push_back({4 * t, 4 * t + 1, 4 * t + 2, 4 * t + 3});
        ids.push_back(t);
    }
    const DataArray array{"CellId", 1, ids};
    ASSERT_TRUE(write_vtu(folder / "ids.vtu", mesh, {{}, {&array, 1}}).ok());
    const Result<OrganInput> refused = read_organ(folder / "ids.vtu", "CellId");
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().message, "the cell array \"CellId\" has 257 different labels; expected at most 256, one for each region");
    ids.back() = 0;
    ASSERT_TRUE(write_vtu(folder / "ids.vtu", mesh, {{}, {&array, 1}}).ok());
    const Result<OrganInput> taken = read_organ(folder / "ids.vtu", "CellId");
    ASSERT_TRUE(taken.ok()) << taken.error().to_string();
    EXPECT_EQ(taken->labels.of_tet.size(), 257u);
}

TEST_F(CellArrays, HaveLabelsThatASceneTakesOrAreRefused) {
    const auto labelled = [&](const std::string& labels) { return read_organ(write("a.vtu", vtu(array_of("region", "Float64", labels))), "region"); };
    for (const char* beyond : {"2147483648", "-2147483648", "9007199254740992"}) {
        const Result<OrganInput> refused = labelled(fmt::format("3 {}", beyond));
        ASSERT_FALSE(refused.ok()) << beyond;
        EXPECT_EQ(refused.error().message,
                  fmt::format("the cell array \"region\" has {} at cell 1; expected an integer from -2147483647 to 2147483647, the label of the cell's region", beyond));
    }
    Result<OrganInput> input = labelled("-2147483647 2147483647");
    ASSERT_TRUE(input.ok()) << input.error().to_string();
    const Result<ImportedOrgan> organ = import_organ(std::move(*input), 1e-3, MendMode::Automatic, {Vec3::UnitZ(), 0.2});
    ASSERT_TRUE(organ.ok()) << organ.error().to_string();
    for (const Result<void>& written : write_organ(*organ, {"liver", "", {}}, folder)) ASSERT_TRUE(written.ok());
    const Result<Scene> scene = read_scene(folder / import_name::kScene);
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_TRUE(make_prepared_scene(*scene).ok());
}

TEST_F(CellArrays, OfGroupsWithOneNameBecomeRegionsOfDifferentNames) {
    using Three = std::array<std::string, 3>;
    const std::vector<std::pair<Three, Three>> cases{{{"a", "a_3", "a"}, {"a", "a_3", "a_3_2"}}, {{"a", "a", "a_2"}, {"a", "a_2_2", "a_2"}}, {{"a", "a", "a"}, {"a", "a_2", "a_3"}}};
    for (const auto& [named, expected] : cases) {
        Result<OrganInput> input = read_organ(
            write("a.msh", fmt::format("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n3 1 \"{}\"\n3 2 \"{}\"\n3 3 \"{}\"\n$EndPhysicalNames\n$Nodes\n6\n{}6 30 30 30\n"
                                       "$EndNodes\n$Elements\n3\n1 4 2 1 1 {}\n2 4 2 2 2 {}\n3 4 2 3 3 2 3 4 6\n$EndElements\n",
                                       named[0], named[1], named[2], rows_of_points(true), corners(0, 1), corners(1, 1))));
        ASSERT_TRUE(input.ok()) << input.error().to_string();
        const Result<ImportedOrgan> organ = import_organ(std::move(*input), 1e-3, MendMode::Automatic, {Vec3::UnitZ(), 0.2});
        ASSERT_TRUE(organ.ok()) << organ.error().to_string();
        ASSERT_EQ(organ->regions.size(), 3u);
        for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(organ->regions[k].name, expected[k]);
        for (const Result<void>& written : write_organ(*organ, {"liver", "", {}}, folder)) ASSERT_TRUE(written.ok());
        const Result<Scene> scene = read_scene(folder / import_name::kScene);
        ASSERT_TRUE(scene.ok()) << scene.error().to_string();
        EXPECT_EQ(scene->bodies[0].coarse.regions.size(), 3u);
    }
}

TEST_F(CellArrays, TakeTheSizeOfAGmshGroupWhateverItsSign) {
    for (const auto& [group, size] : {std::pair("-3", 3.0), std::pair("-9223372036854775808", 9223372036854775808.0)}) {
        BesideTets beside;
        beside.with_arrays = true;
        const Result<TetMesh> mesh = read_tets(write("a.msh", "$NOD\n5\n" + rows_of_points(true) + fmt::format("$ENDNOD\n$ELM\n1\n1 4 {} 11 4 1 2 3 4\n$ENDELM\n", group)), &beside);
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        ASSERT_FALSE(beside.arrays.empty());
        EXPECT_EQ(beside.arrays[0].name, "gmsh:physical");
        EXPECT_EQ(beside.arrays[0].values, std::vector<double>{size});
    }
}

/// Damage anywhere: an error, or a mesh whose labels fit it.
TEST_F(CellArrays, OfRandomlyDamagedFilesNeverCrash) {
    std::mt19937 random(7);
    const std::vector<std::pair<std::string, std::string>> samples{{"a.msh", msh2(false)},        {"b.msh", msh2(true)}, {"c.msh", msh4()},   {"d.msh", msh4_binary()}, {"a.vtk", vtk(kScalars)},
                                                                   {"b.vtk", vtk_binary()}, {"a.mesh", medit()},   {"a.veg", veg(kSets)}, {"a.vtu", vtu(array_of("region", "Int32", "3 7"))}};
    for (const auto& [name, text] : samples)
        for (int round = 0; round < 150; ++round) {
            std::string bytes = text;
            for (unsigned hits = 1 + random() % 3; hits > 0; --hits) {
                const std::size_t at = random() % bytes.size();
                if (random() % 3 == 0)
                    bytes.replace(at, 1, "99999999999999");
                else
                    bytes[at] = static_cast<char>(random());
            }
            if (round % 5 == 0) bytes.resize(random() % bytes.size());
            BesideTets beside;
            beside.with_arrays = true;
            const Result<TetMesh> mesh = read_tets(write(name, bytes), &beside);
            if (!mesh.ok()) continue;
            const Result<TetLabels> labels = find_tet_labels(beside);
            if (labels.ok() && !beside.arrays.empty()) EXPECT_EQ(labels->of_tet.size(), mesh->tets.size());
        }
}

TEST_F(CellArrays, OfAnImportedOrganStandInItsSceneWithTheFilesNames) {
    Result<OrganInput> input = read_organ(write("liver.msh", msh4()));
    ASSERT_TRUE(input.ok()) << input.error().to_string();
    const Result<ImportedOrgan> organ = import_organ(std::move(*input), 1e-3, MendMode::Automatic, {Vec3::UnitZ(), 0.2});
    ASSERT_TRUE(organ.ok()) << organ.error().to_string();
    ASSERT_EQ(organ->regions.size(), 2u);
    EXPECT_EQ(describe_region(organ->regions[0]), "right_lobe (label 3): 1 tetrahedra, 1500 mm^3");
    EXPECT_EQ(describe_region(organ->regions[1]), "tumour (label 7): 1 tetrahedra, 3000 mm^3");
    for (const Result<void>& written : write_organ(*organ, {"liver", "", {}}, folder)) ASSERT_TRUE(written.ok());
    Result<Scene> scene = read_scene(folder / import_name::kScene);
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    const CoarseSpec& coarse = scene->bodies[0].coarse;
    ASSERT_EQ(coarse.regions.size(), 2u);
    EXPECT_EQ(coarse.regions[0].name, "right_lobe");
    EXPECT_EQ(coarse.regions[0].label, 3);
    EXPECT_EQ(coarse.regions[1].name, "tumour");
    const auto prepared = make_prepared_scene(*scene);
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    EXPECT_EQ(prepared->bodies[0].regions.size(), 2u);
    scene->bodies[0].coarse.regions.clear();
    const auto plain = make_prepared_scene(*scene);
    ASSERT_TRUE(plain.ok());
    EXPECT_EQ(hash_model(plain->model), hash_model(prepared->model)) << "they begin with the organ's own material";
}

TEST_F(CellArrays, OfAFileThatNamesItsGroupsNeedNoLabelInAScene) {
    write("liver.msh", msh4());
    const auto scene_text = [&](const std::string& regions) {
        return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 0.1}}, "bodies": {{"liver": {{"kind": "deformable",
            "surface": "{0}", "material": {{"young_modulus": 5}}, "coarse": {{"file": "{0}", "regions": {1}}}}}}}, "effects": ["elasticity"]}})",
                           (folder / "liver.msh").string(), regions);
    };
    const Result<Scene> scene = parse_scene(scene_text(R"({"tumour": {"young_modulus": 50, "density": 1200}})"), "a.json");
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    const auto prepared = make_prepared_scene(*scene);
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    EXPECT_NEAR(prepared->model.bodies[0].tissue->mass, 1060.0 * 1500e-9 + 1200.0 * 3000e-9, 1e-12);
    EXPECT_EQ(prepared->bodies[0].regions[0].name, "right lobe");
    const Result<Scene> mistyped = parse_scene(scene_text(R"({"tumor": {"young_modulus": 50}})"), "a.json");
    ASSERT_TRUE(mistyped.ok()) << mistyped.error().to_string();
    const auto refused = make_prepared_scene(*mistyped);
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(refused.error().to_string(), HasSubstr("nearest known region of the file: \"tumour\" (known: right lobe, tumour)"));
}

} // namespace
} // namespace trocar::engine::test
