// Every format, in every variant that is promised, reads as the same tetrahedron.
#include "base/topology.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/weld.hpp"
#include "engine/io/write_mesh.hpp"
#include "io_bytes.hpp"

#include <clocale>
#include <locale>

namespace trocar::engine::test {
namespace {

using Formats = FolderTest;

TEST_F(Formats, EveryTetrahedraSampleIsTheUnitTetrahedron) {
    for (const Sample& sample : tet_samples()) {
        SCOPED_TRACE(sample.name);
        const Result<TetMesh> mesh = read_tets(write(sample.name, sample.bytes));
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        EXPECT_EQ(mesh->vertices.size(), 4u);
        const TetMeshReport report = inspect_tets(*mesh);
        EXPECT_EQ(report.tets, 1u);
        EXPECT_TRUE(report.valid());
        EXPECT_DOUBLE_EQ(report.volume, 1.0 / 6.0);
        EXPECT_EQ(mesh->vertices[mesh->tets[0][3]], Vec3(0, 0, 1));
    }
}

TEST_F(Formats, EverySurfaceSampleIsTheClosedTetrahedron) {
    for (const Sample& sample : surface_samples()) {
        SCOPED_TRACE(sample.name);
        const Result<TriMesh> mesh = read_surface(write(sample.name, sample.bytes));
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        EXPECT_EQ(mesh->vertices.size(), 4u);
        const SurfaceReport report = inspect_surface(*mesh);
        EXPECT_EQ(report.triangles, 4u);
        EXPECT_TRUE(report.closed() && report.manifold() && report.oriented());
        EXPECT_DOUBLE_EQ(report.signed_volume, 1.0 / 6.0);
    }
}

TEST_F(Formats, GzipIsRecognisedByItsBytesWhateverTheName) {
    for (const Sample& sample : surface_samples()) {
        SCOPED_TRACE(sample.name);
        for (const std::string& name : {sample.name + ".gz", sample.name}) {
            const Result<TriMesh> mesh = read_surface(write(name, deflate_bytes(sample.bytes)));
            ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
            EXPECT_EQ(mesh->triangles.size(), 4u);
        }
    }
}

TEST_F(Formats, GzipOfSeveralMembersIsReadToItsEnd) {
    const std::string text = surface_samples()[0].bytes;
    const Result<TriMesh> mesh = read_surface(write("two.obj.gz", deflate_bytes(text.substr(0, 20)) + deflate_bytes(text.substr(20))));
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_EQ(mesh->triangles.size(), 4u);
}

TEST_F(Formats, ATetGenPairIsFoundFromEitherFile) {
    (void)write("a.1.node", "# nodes\n4 3 0 1\n0 0 0 0 1\n1 1 0 0 1\n2 0 1 0 1\n3 0 0 1 1\n# made by TetGen\n");
    (void)write("a.1.ele", "1 4 1\n0 0 1 2 3 7\n");
    for (const char* name : {"a.1.node", "a.1.ele"}) {
        const Result<TetMesh> mesh = read_tets(folder_ / name);
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        EXPECT_TRUE(inspect_tets(*mesh).valid());
    }
}

TEST_F(Formats, AFileOfTheOtherOrientationIsTurnedRoundAsAWhole) {
    const std::string head =
        "MeshVersionFormatted 1\nDimension 3\nVertices\n5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\nTetrahedra\n2\n";
    const Result<TetMesh> turned = read_tets(write("negative.mesh", head + "2 1 3 4 0\n2 4 3 5 0\nEnd\n"));
    ASSERT_TRUE(turned.ok());
    EXPECT_TRUE(inspect_tets(*turned).valid());
    const Result<TetMesh> mixed = read_tets(write("mixed.mesh", head + "1 2 3 4 0\n2 4 3 5 0\nEnd\n"));
    ASSERT_TRUE(mixed.ok());
    EXPECT_EQ(inspect_tets(*mixed).inverted_tets, 1u);
}

TEST_F(Formats, PiecesOfAVtuKeepTheirOwnPoints) {
    const std::string piece = "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" format=\"ascii\">"
                              "0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>"
                              "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>"
                              "<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>"
                              "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece>";
    const Result<TetMesh> mesh = read_tets(
        write("pieces.vtu", "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>" + piece + piece + "</UnstructuredGrid></VTKFile>"));
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_EQ(mesh->vertices.size(), 8u);
    EXPECT_EQ(inspect_tets(*mesh).components, 2u);
}

TEST_F(Formats, ObjGroupsKeepTheirFacesAndVertices) {
    const std::filesystem::path path =
        write("groups.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nv 6 5 5\nv 5 6 5\no body\ng aorta wall\nf 1 2 3\n"
                            "g coeliac\nf 4 5 6\ng empty\n");
    const Result<TriMesh> one = read_surface(path, {.groups = {"coeliac"}});
    ASSERT_TRUE(one.ok()) << one.error().to_string();
    EXPECT_EQ(one->triangles, (std::vector<Triangle>{{0, 1, 2}}));
    EXPECT_EQ(one->vertices.size(), 3u);
    EXPECT_EQ(one->vertices[0], Vec3(5, 5, 5));
    EXPECT_EQ(read_surface(path, {.groups = {"wall", "coeliac"}})->triangles.size(), 2u);
    EXPECT_EQ(read_surface(path, {.groups = {"body"}})->triangles.size(), 2u);
    EXPECT_EQ(*read_surface_groups(path), (std::vector<std::string>{"aorta", "body", "coeliac", "wall"}));

    const Result<TriMesh> unknown = read_surface(path, {.groups = {"celiac"}});
    ASSERT_FALSE(unknown.ok());
    EXPECT_EQ(unknown.error().code, ErrorCode::BadValue);
    EXPECT_NE(unknown.error().message.find("aorta, body, coeliac, wall"), std::string::npos) << unknown.error().to_string();
    EXPECT_FALSE(read_surface(write("t.off", surface_samples()[7].bytes), {.groups = {"x"}}).ok());
}

TEST_F(Formats, UnreferencedVerticesStayUnlessAWeldIsWanted) {
    const std::filesystem::path path = write("spare.obj", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 -0\nv 1 1 0\nf 2 3 4\nf 5 6 4\n");
    EXPECT_EQ(read_surface(path)->vertices.size(), 6u);
    const Result<TriMesh> welded = read_surface(path, {.weld = true});
    EXPECT_EQ(welded->vertices.size(), 4u);
    EXPECT_EQ(welded->triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
}

TEST_F(Formats, AVertexMayComeAfterItsFace) {
    const Result<TriMesh> mesh = read_surface(write("late.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"));
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_EQ(mesh->triangles.size(), 1u);
}

struct DecimalComma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
};

TEST_F(Formats, NumbersReadAndWriteTheSameWithDecimalCommas) {
    const std::locale before = std::locale::global(std::locale(std::locale(), new DecimalComma));
    const std::string old_c = std::setlocale(LC_ALL, nullptr);
    for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE"}) // where one is installed, C functions use commas as well
        if (std::setlocale(LC_ALL, name)) break;
    const TriMesh half{.vertices = {{0.5, 0, 0}, {1234567, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}};
    const bool written = write_obj(folder_ / "half.obj", half).ok();
    const Result<TriMesh> mesh = read_surface(folder_ / "half.obj");
    const std::string text = slurp(folder_ / "half.obj");
    std::setlocale(LC_ALL, old_c.c_str());
    std::locale::global(before);
    ASSERT_TRUE(written);
    EXPECT_EQ(text, "v 0.5 0 0\nv 1234567 0 0\nv 0 1 0\nf 1 2 3\n");
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_EQ(mesh->vertices, half.vertices);
}

TEST_F(Formats, ExtremeNumbersAreRoundedNotRefused) {
    const Result<TriMesh> mesh = read_surface(write("tiny.obj", "v 1e-400 0 0\nv 1e-310 0.1 1e300\nv 0 1 0\nf 1 2 3\n"));
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_EQ(mesh->vertices[0].x(), 0.0);
    EXPECT_EQ(mesh->vertices[1], Vec3(1e-310, 0.1, 1e300));
}

} // namespace
} // namespace trocar::engine::test
