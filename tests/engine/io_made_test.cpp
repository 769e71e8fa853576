// Surfaces and tetrahedra made here, written in every format by this test and read back: the counts are those they were made with.
#include "base/topology.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/write_mesh.hpp"
#include "fem/mesh/lattice.hpp"
#include "io_bytes.hpp"
#include "tests/made/surfaces.hpp"

#include <fmt/format.h>

namespace trocar::engine::test {
namespace {

std::string points_of(const std::vector<Vec3>& vertices, const char* before = "") {
    std::string text;
    for (const Vec3& v : vertices) text += fmt::format("{}{} {} {}\n", before, v[0], v[1], v[2]);
    return text;
}

std::string as_off(const TriMesh& mesh) {
    std::string text = fmt::format("OFF\n{} {} 0\n", mesh.vertices.size(), mesh.triangles.size()) + points_of(mesh.vertices);
    for (const Triangle& t : mesh.triangles) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
    return text;
}

std::string as_ply(const TriMesh& mesh) {
    std::string bytes = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n"
                                    "property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
                                    mesh.vertices.size(), mesh.triangles.size());
    for (const Vec3& v : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) put(bytes, v[axis]);
    for (const Triangle& t : mesh.triangles) {
        put(bytes, std::uint8_t{3});
        for (const Index v : t) put(bytes, static_cast<std::int32_t>(v));
    }
    return bytes;
}

/// In single precision, as the format has it.
std::string as_stl(const TriMesh& mesh) {
    std::string bytes(80, ' ');
    put(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
    for (const Triangle& t : mesh.triangles) {
        for (int k = 0; k < 3; ++k) put(bytes, 0.0f);
        for (const Index v : t)
            for (int axis = 0; axis < 3; ++axis) put(bytes, static_cast<float>(mesh.vertices[v][axis]));
        put(bytes, std::uint16_t{0});
    }
    return bytes;
}

std::string as_medit(const TetMesh& mesh) {
    std::string text = fmt::format("MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n", mesh.vertices.size());
    for (const Vec3& v : mesh.vertices) text += fmt::format("{} {} {} 0\n", v[0], v[1], v[2]);
    text += fmt::format("Tetrahedra\n{}\n", mesh.tets.size());
    for (const Tet& t : mesh.tets) text += fmt::format("{} {} {} {} 0\n", t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
    return text + "End\n";
}

std::string as_vtk(const TetMesh& mesh) {
    std::string text =
        fmt::format("# vtk DataFile Version 3.0\ntets\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n", mesh.vertices.size()) +
        points_of(mesh.vertices) + fmt::format("CELLS {} {}\n", mesh.tets.size(), 5 * mesh.tets.size());
    for (const Tet& t : mesh.tets) text += fmt::format("4 {} {} {} {}\n", t[0], t[1], t[2], t[3]);
    text += fmt::format("CELL_TYPES {}\n", mesh.tets.size());
    for (std::size_t k = 0; k < mesh.tets.size(); ++k) text += "10\n";
    return text;
}

class MadeFiles : public FolderTest {};

TEST_F(MadeFiles, EverySurfaceComesBackFromEveryFormatWithItsCounts) {
    std::size_t read = 0;
    for (const made::Named& one : made::make_all(3000)) {
        const SurfaceReport made = inspect_surface(one.mesh);
        std::string obj = points_of(one.mesh.vertices, "v ");
        for (const Triangle& t : one.mesh.triangles) obj += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
        for (const auto& [extension, bytes] :
             {std::pair("obj", obj), std::pair("obj.gz", deflate_bytes(obj)), std::pair("off", as_off(one.mesh)),
              std::pair("ply", as_ply(one.mesh)), std::pair("stl", as_stl(one.mesh))}) {
            SCOPED_TRACE(one.name + " as " + extension);
            const auto mesh = read_surface(write(std::string("made.") + extension, bytes), {.weld = true});
            ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
            EXPECT_EQ(mesh->vertices.size(), one.mesh.vertices.size() - made.unreferenced_vertices);
            EXPECT_EQ(mesh->triangles.size(), one.mesh.triangles.size());
            const SurfaceReport report = inspect_surface(*mesh);
            EXPECT_EQ(report.components, made.components);
            EXPECT_EQ(report.boundary_edges, made.boundary_edges);
            EXPECT_NEAR(report.signed_volume, made.signed_volume, 1e-5 * std::abs(made.signed_volume));
            ++read;
        }
    }
    EXPECT_GE(read, 40u);
}

TEST_F(MadeFiles, EveryTetMeshComesBackFromEveryFormatWithItsCountsAndItsBoundary) {
    for (const TriMesh& surface : {made::make_organ(1, 3), made::make_animal(1, 3000)}) {
        const auto lattice = fem::make_lattice_mesh(surface, {.cell = fem::find_lattice_cell(surface, 900)});
        ASSERT_TRUE(lattice.ok()) << lattice.error().to_string();
        const TetMesh& tets = lattice->tets;
        const std::size_t boundary = boundary_surface(tets).triangles.size();
        EXPECT_GT(tets.tets.size(), 300u);
        ASSERT_TRUE(write_vtu(write("made.vtu", ""), tets).ok());
        for (const auto& file :
             {write("made.mesh", as_medit(tets)), write("made.vtk", as_vtk(tets)), write("made.vtk.gz", deflate_bytes(as_vtk(tets))),
              write("made.mesh", as_medit(tets)).parent_path() / "made.vtu"}) {
            SCOPED_TRACE(file);
            const auto mesh = read_tets(file);
            ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
            EXPECT_EQ(mesh->tets.size(), tets.tets.size());
            EXPECT_EQ(mesh->vertices.size(), tets.vertices.size());
            EXPECT_EQ(boundary_surface(*mesh).triangles.size(), boundary);
            EXPECT_NEAR(inspect_tets(*mesh).volume, inspect_tets(tets).volume, 1e-6 * inspect_tets(tets).volume);
        }
    }
}

TEST_F(MadeFiles, ABackslashContinuesAFaceAndAVertex) {
    const auto mesh = read_surface(write("wall.obj", "v 0 0 0\nv 1 \\\n0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n3 4\n"), {});
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_EQ(mesh->vertices.size(), 4u);
    EXPECT_EQ(mesh->triangles.size(), 2u);
}

/// One vessel of a made tree by its name, as a scan's file holds many.
TEST_F(MadeFiles, AVesselIsTakenFromATreeByName) {
    std::string text;
    std::size_t first = 1;
    std::vector<std::size_t> counts;
    for (const made::Tube& tube : made::make_tubes(3)) {
        const TriMesh part = anatomy::make_capsule(tube.from, tube.to, tube.radius, 12);
        text += points_of(part.vertices, "v ") + fmt::format("g vessel_{}\n", counts.size());
        for (const Triangle& t : part.triangles) text += fmt::format("f {} {} {}\n", t[0] + first, t[1] + first, t[2] + first);
        first += part.vertices.size();
        counts.push_back(part.triangles.size());
    }
    const auto file = write("tree.obj", text);
    const auto groups = read_surface_groups(file);
    ASSERT_TRUE(groups.ok());
    EXPECT_EQ(groups->size(), counts.size());
    const auto part = read_surface(file, {.groups = {"vessel_1", "vessel_4"}});
    ASSERT_TRUE(part.ok()) << part.error().to_string();
    EXPECT_EQ(part->triangles.size(), counts[1] + counts[4]);
    EXPECT_EQ(inspect_surface(*part).unreferenced_vertices, 0u);
    EXPECT_EQ(inspect_surface(*part).components, 2u);
}

} // namespace
} // namespace trocar::engine::test
