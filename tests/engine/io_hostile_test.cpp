// Damaged and hostile files: always an Error with the file's name, never a crash, a hang or an allocation that the
// file's size does not justify. (The counts below ask for terabytes: granting them would end the test.)
#include "engine/io/formats.hpp"
#include "engine/io/mesh_path.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/read_tets.hpp"
#include "io_bytes.hpp"

#include <chrono>
#include <cstdlib>
#include <random>

#include <sys/stat.h>

namespace trocar::engine::test {
namespace {

using HostileFiles = FolderTest;

const std::string kName = "some/mesh";

/// What holds for every outcome; true for a mesh.
template <class Mesh, class Cells>
bool is_sound(const Result<Mesh>& mesh, Cells Mesh::*cells) {
    if (!mesh.ok()) {
        EXPECT_EQ(mesh.error().file, kName);
        EXPECT_FALSE(mesh.error().message.empty());
        return false;
    }
    EXPECT_FALSE(((*mesh).*cells).empty());
    for (const auto& cell : (*mesh).*cells)
        for (const Index v : cell) EXPECT_LT(v, mesh->vertices.size());
    for (const Vec3& v : mesh->vertices) EXPECT_TRUE(is_finite(v));
    return true;
}

/// Parses bytes as the format of the named sample, surface and volume where a format has both.
bool parse_is_sound(const std::string& name, const std::string& bytes) {
    const std::string extension = mesh_extension(name);
    const auto surface = [](const Result<TriMesh>& mesh) { return is_sound(mesh, &TriMesh::triangles); };
    const auto tets = [](const Result<TetMesh>& mesh) { return is_sound(mesh, &TetMesh::tets); };
    if (extension == ".obj") {
        Result<GroupedSurface> grouped = parse_obj(bytes, kName, {});
        return surface(grouped ? Result<TriMesh>(grouped->mesh) : Result<TriMesh>(grouped.error()));
    }
    if (extension == ".ply") return surface(parse_ply(bytes, kName));
    if (extension == ".stl") return surface(parse_stl(bytes, kName));
    if (extension == ".off") return surface(parse_off(bytes, kName));
    BesideTets beside;
    beside.with_arrays = true;
    if (extension == ".msh") return tets(parse_msh(bytes, kName, &beside));
    if (extension == ".mesh") return tets(parse_medit(bytes, kName, &beside));
    if (extension == ".veg") return tets(parse_veg(bytes, kName, &beside));
    const Result<VtkMesh> vtk = extension == ".vtk" ? parse_vtk_legacy(bytes, kName) : parse_vtk_xml(bytes, kName);
    if (!vtk) return surface(vtk.error());
    const bool as_surface = surface(make_surface(VtkMesh(*vtk), kName));
    return tets(make_tets(VtkMesh(*vtk), kName)) || as_surface;
}

std::vector<Sample> all_samples() {
    std::vector<Sample> samples = tet_samples();
    for (Sample& sample : surface_samples()) samples.push_back(std::move(sample));
    return samples;
}

TEST_F(HostileFiles, CutOffAnywhereAnErrorOrASmallerMeshComesBack) {
    for (const Sample& sample : all_samples()) {
        SCOPED_TRACE(sample.name);
        EXPECT_TRUE(parse_is_sound(sample.name, sample.bytes));
        for (std::size_t size = 0; size < sample.bytes.size(); ++size) parse_is_sound(sample.name, sample.bytes.substr(0, size));
    }
}

TEST_F(HostileFiles, BinaryFilesCutOffInTheirDataAreRefused) {
    for (const Sample& sample : {Sample{"gmsh2_binary.msh", binary_msh2()}, Sample{"a.vtk", vtk_binary(false)},
                                 Sample{"little.ply", binary_ply(false)}, Sample{"binary.STL", binary_stl()}}) {
        SCOPED_TRACE(sample.name);
        const std::size_t cut = sample.name == "a.vtk" ? sample.bytes.find("CELL_TYPES") : sample.bytes.size() - 20;
        const std::filesystem::path path = write(sample.name, std::string_view(sample.bytes).substr(0, cut));
        EXPECT_FALSE(sample.name.ends_with(".msh") || sample.name.ends_with(".vtk") ? read_tets(path).ok() : read_surface(path).ok());
    }
}

TEST_F(HostileFiles, RandomDamageNeverCrashes) {
    const char* wanted = std::getenv("TROCAR_TEST_SEED"); // other damage than in the last run
    const unsigned long seed = wanted ? std::strtoul(wanted, nullptr, 10) : 20261120;
    std::mt19937 random(static_cast<std::mt19937::result_type>(seed));
    for (const Sample& sample : all_samples()) {
        SCOPED_TRACE(sample.name + ", seed " + std::to_string(seed));
        for (int round = 0; round < 1000; ++round) {
            std::string bytes = sample.bytes;
            for (unsigned hits = 1 + random() % 4; hits > 0; --hits) {
                const std::size_t at = random() % bytes.size();
                if (random() % 3 == 0)
                    bytes.replace(at, 1, "99999999999999");
                else
                    bytes[at] = static_cast<char>(random());
            }
            parse_is_sound(sample.name, bytes);
        }
    }
}

TEST_F(HostileFiles, HugeCountsAreRefusedBeforeAnythingIsAllocated) {
    const std::string huge = "4000000000000";
    const Sample cases[] = {
        {"a.off", "OFF\n" + huge + " 1 0\n0 0 0\n"},
        {"b.off", "OFF\n3 " + huge + " 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
        {"c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n" + huge + " 0 1 2\n"},
        {"a.ply",
         "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n"},
        {"b.ply", "ply\nformat ascii 1.0\nelement nothing " + huge +
                      "\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                      "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n"},
        {"c.ply", "ply\nformat binary_little_endian 1.0\nelement face 4000000000\nproperty list uchar int vertex_indices\nelement vertex "
                  "1\nproperty uchar x\n"
                  "property uchar y\nproperty uchar z\nend_header\n\x01"},
        {"a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + huge + "\n1 0 0 0\n"},
        {"b.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 " + huge + " 1 1\n3 1 0 " + huge + "\n1\n0 0 0\n"},
        {"c.msh", "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n" + huge + "\n1 4 1 1 4 1 1 1 1\n"},
        {"a.vtk", "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 4000000000 double\n0"},
        {"b.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 double\n0 0 0\nCELLS " + huge + " 2\n1 0\n"},
        {"c.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nFIELD f 1\na " + huge + " " + huge + " double\n0\n"},
        {"d.vtk", "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 double\n0 0 0\nCELLS " + huge +
                      " 2\nOFFSETS vtktypeint64\n0 1\n"},
        {"a.mesh", "MeshVersionFormatted 1\nDimension 3\nVertices\n" + huge + "\n0 0 0 0\n"},
        {"a.veg", "*VERTICES\n" + huge + " 3 0 0\n1 0 0 0\n"},
    };
    for (const Sample& sample : cases) {
        SCOPED_TRACE(sample.name);
        const std::filesystem::path path = write(sample.name, sample.bytes);
        const bool surface = sample.name.ends_with(".off") || sample.name.ends_with(".ply");
        const Error error = surface ? read_surface(path).error() : read_tets(path).error();
        EXPECT_EQ(error.file, path.string());
        EXPECT_NE(error.message.find("bytes follow"), std::string::npos) << error.to_string();
    }
}

TEST_F(HostileFiles, HugeSizesInsideAVtuAreRefused) {
    std::string head;
    put<std::uint64_t>(head, std::uint64_t{1} << 60);
    const auto file = [&](const char* attribute, const std::string& payload) {
        return "<VTKFile type=\"UnstructuredGrid\" header_type=\"UInt64\"" + std::string(attribute) +
               "><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" format=\"binary\">" +
               payload + "</DataArray></Points></Piece></UnstructuredGrid></VTKFile>";
    };
    EXPECT_FALSE(read_tets(write("plain.vtu", file("", base64(head)))).ok());
    EXPECT_FALSE(read_tets(write("blocks.vtu", file(" compressor=\"vtkZLibDataCompressor\"", base64(head + head + head)))).ok());
    // One honest-looking block that unfolds to more than a mesh ever does.
    const std::string bomb = deflate_bytes(std::string(48u << 20, '\0'), 15);
    std::string block;
    for (const std::uint64_t v : {std::uint64_t{1}, std::uint64_t{48u << 20}, std::uint64_t{0}, std::uint64_t{bomb.size()}}) put(block, v);
    const Result<TetMesh> mesh = read_tets(write("bomb.vtu", file(" compressor=\"vtkZLibDataCompressor\"", base64(block) + base64(bomb))));
    ASSERT_FALSE(mesh.ok());
    EXPECT_NE(mesh.error().message.find("unfolds"), std::string::npos) << mesh.error().to_string();
}

TEST_F(HostileFiles, AGzipBombIsRefusedByItsRatio) {
    const std::string bomb = deflate_bytes("# " + std::string(48u << 20, ' '));
    ASSERT_LT(bomb.size(), std::size_t{1} << 20);
    const Result<TriMesh> mesh = read_surface(write("bomb.obj.gz", bomb));
    ASSERT_FALSE(mesh.ok());
    EXPECT_NE(mesh.error().message.find("unfolds to more than"), std::string::npos) << mesh.error().to_string();
}

TEST_F(HostileFiles, DamagedGzipIsAnError) {
    const std::string good = deflate_bytes(surface_samples()[0].bytes);
    for (std::size_t size = 2; size < good.size(); ++size)
        EXPECT_FALSE(read_surface(write("cut.obj.gz", std::string_view(good).substr(0, size))).ok()) << size;
    std::string flipped = good;
    flipped[good.size() - 6] = static_cast<char>(flipped[good.size() - 6] ^ 1); // the check sum
    EXPECT_FALSE(read_surface(write("flipped.obj.gz", flipped)).ok());
}

TEST_F(HostileFiles, ErrorsNameFileAndLine) {
    struct Case {
        Sample sample;
        std::size_t line;
        const char* word;
    };
    const Case cases[] = {
        {{"nan.obj", "v 0 0 0\n# c\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"}, 3, "not finite"},
        {{"range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n\nf 1 2 100\nf 1 2 3\n"}, 6, "vertex index 100"},
        {{"zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"}, 4, "vertex index 0"},
        {{"word.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nff 1 2 3\n"}, 4, "'ff'"},
        {{"short.obj", "v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n"}, 3, "'v' is not a number"},
        {{"comma.off", "OFF\n3 1 0\n0,5 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"}, 3, "'0,5'"},
        {{"inf.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                     "property list uchar int vertex_indices\nend_header\n0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n"},
         11,
         "not finite"},
        {{"loop.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid\n"},
         6,
         "facet with 2"},
        {{"tail.msh", "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 1 1 2\n$ENDELM\n"}, 7, "node 2"},
        {{"text.vtu",
          "<VTKFile type=\"UnstructuredGrid\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"1\" NumberOfCells=\"0\">\n<Points>\n"
          "<DataArray type=\"Float64\" format=\"ascii\">\n0 0\nzero\n</DataArray></Points></Piece></UnstructuredGrid></VTKFile>"},
         7,
         "'zero'"},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.sample.name);
        const std::filesystem::path path = write(c.sample.name, c.sample.bytes);
        const bool tets = c.sample.name.ends_with(".msh") || c.sample.name.ends_with(".vtu");
        ASSERT_FALSE(tets ? read_tets(path).ok() : read_surface(path).ok());
        const Error error = tets ? read_tets(path).error() : read_surface(path).error();
        EXPECT_EQ(error.line, c.line) << error.to_string();
        EXPECT_NE(error.message.find(c.word), std::string::npos) << error.to_string();
    }
}

TEST_F(HostileFiles, WhatIsNoFileIsRefusedAtOnce) {
    ASSERT_EQ(::mkfifo((folder_ / "pipe.obj").c_str(), 0600), 0); // opening it must not wait for a writer
    std::filesystem::create_directory(folder_ / "folder.obj");
    for (const char* name : {"pipe.obj", "folder.obj", "missing.obj"}) {
        const Result<TriMesh> mesh = read_surface(folder_ / name);
        ASSERT_FALSE(mesh.ok()) << name;
        EXPECT_EQ(mesh.error().code, ErrorCode::FileNotFound) << mesh.error().to_string();
    }
    EXPECT_EQ(read_surface(write("mesh.docx", "x")).error().code, ErrorCode::BadUsage);
    EXPECT_EQ(read_tets(write("mesh.obj", "v 0 0 0")).error().code, ErrorCode::BadUsage);
}

TEST_F(HostileFiles, DeeplyNestedXmlIsRefused) {
    std::string nested;
    for (int i = 0; i < 2000000; ++i) nested += "<a>";
    EXPECT_FALSE(read_tets(write("deep.vtu", nested)).ok());
}

TEST_F(HostileFiles, PlyFacesNameNoVerticesThatAreNotStored) {
    const std::string head = "ply\nformat ascii 1.0\n",
                      face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1 2\n";
    const Result<TriMesh> bare = read_surface(write("bare.ply", head + "element vertex 3\n" + face), {.weld = true});
    ASSERT_FALSE(bare.ok());
    EXPECT_NE(bare.error().message.find("no x, y and z"), std::string::npos) << bare.error().to_string();
    const std::string most = "element vertex 9223372036854775807\nproperty float x\nproperty float y\nproperty float z\n";
    EXPECT_FALSE(read_surface(write("sum.ply", head + most + most + face)).ok());
}

TEST_F(HostileFiles, NodeNumbersAtTheEndsOfTheirRangeAreNames) {
    const std::string ids[] = {"9223372036854775807", "-9223372036854775808", "-9223372036854775807", "-9223372036854775806"};
    const std::string nodes = ids[0] + " 0 0 0\n" + ids[1] + " 1 0 0\n" + ids[2] + " 0 1 0\n" + ids[3] + " 0 0 1\n";
    const std::string tet = ids[0] + " " + ids[1] + " " + ids[2] + " " + ids[3] + "\n";
    for (const auto& path : {write("a.msh", "$NOD\n4\n" + nodes + "$ENDNOD\n$ELM\n1\n1 4 1 1 4 " + tet + "$ENDELM\n"),
                             write("a.veg", "*VERTICES\n4 3 0 0\n" + nodes + "*ELEMENTS\nTET\n1 4 0\n1 " + tet)}) {
        const Result<TetMesh> mesh = read_tets(path);
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        EXPECT_EQ(mesh->tets, (std::vector<Tet>{{0, 1, 2, 3}}));
    }
}

TEST_F(HostileFiles, OnePlaceOfAppendedDataIsNotUnfoldedForEveryArray) {
    std::string block; // a million points in 12 MB: a file of 4,000 pieces that name them would take a hundred gigabytes
    put<std::uint32_t>(block, 12u << 20);
    block.append(12u << 20, '\0');
    std::string xml = R"(<VTKFile type="PolyData" byte_order="LittleEndian"><PolyData>)";
    for (int i = 0; i < 4000; ++i)
        xml += R"(<Piece NumberOfPoints="1048576"><Points><DataArray type="Float32" format="appended" offset="0"/></Points></Piece>)";
    xml += R"(</PolyData><AppendedData encoding="raw">_)" + block + "</AppendedData></VTKFile>";
    const Result<TriMesh> mesh = read_surface(write("shared.vtp", xml));
    ASSERT_FALSE(mesh.ok());
    EXPECT_NE(mesh.error().message.find("unfold to more than"), std::string::npos) << mesh.error().to_string();
}

TEST_F(HostileFiles, ReadingTakesTimeInProportionToTheSize) {
    // Gigantic lines, and many tiny ones: none may be quadratic.
    std::string polygon = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf";
    for (int i = 0; i < 1000000; ++i) polygon += " 1 2 3";
    std::string groups = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int i = 0; i < 100000; ++i) groups += "g group" + std::to_string(i) + "\nf 1 2 3\n";
    std::string names = "v 0 0 0\nv 1 0 0\nv 0 1 0\ng";
    for (int i = 0; i < 100000; ++i) names += " n" + std::to_string(i);
    for (int i = 0; i < 100000; ++i) names += "\no x\nf 1 2 3";
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(read_surface(write("polygon.obj", polygon))->triangles.size(), 2999998u);
    EXPECT_EQ(read_surface(write("groups.obj", groups))->triangles.size(), 100000u);
    EXPECT_EQ(read_surface(write("names.obj", names))->triangles.size(), 100000u);
    std::string pieces = R"(<VTKFile type="PolyData"><PolyData>)" + std::string(20'000'000, '\n'); // lines before every array
    for (int i = 0; i < 20000; ++i)
        pieces +=
            R"(<Piece NumberOfPoints="3" NumberOfPolys="1"><Points><DataArray type="Float32" format="ascii">0 0 0 1 0 0 0 1 0</DataArray></Points></Piece>)";
    EXPECT_FALSE(read_surface(write("pieces.vtp", pieces + "</PolyData></VTKFile>")).ok()); // points alone
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

} // namespace
} // namespace trocar::engine::test
