// Builds mesh files in memory, byte by byte and independently of the readers, and gives tests a folder of their own.
#pragma once

#include "tests/temp_folder.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

namespace trocar::engine::test {

/// Appends a number in the wanted byte order (the machine is little-endian).
template <class T>
void put(std::string& bytes, T value, bool big = false) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big) std::reverse(raw, raw + sizeof(T));
    bytes.append(raw, sizeof(T));
}

inline std::string base64(std::string_view bytes) {
    const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63];
    }
    return text;
}

/// zlib (window bits 15) or gzip (31).
inline std::string deflate_bytes(std::string_view bytes, int window_bits = 31) {
    z_stream stream{};
    EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, window_bits, 9, Z_DEFAULT_STRATEGY), Z_OK);
    std::string out(deflateBound(&stream, bytes.size()) + 32, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

/// The same with what these tests read of it.
class FolderTest : public trocar::FolderTest {
protected:
    [[nodiscard]] static std::string slurp(const std::filesystem::path& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    [[nodiscard]] std::size_t files_in_folder() const {
        return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_), {}));
    }

    const std::filesystem::path& folder_ = folder;
};

/// A tetrahedron's surface and volume, in whatever format: what every well-formed sample below must read as.
struct Sample {
    std::string name, bytes;
};

inline std::string binary_msh2() {
    std::string b = "$MeshFormat\n2.2 1 8\n";
    put<std::int32_t>(b, 1);
    b += "\n$EndMeshFormat\n$Nodes\n4\n";
    const double corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int i = 0; i < 4; ++i) {
        put<std::int32_t>(b, 10 * i + 7);
        for (const double c : corners[i]) put(b, c);
    }
    b += "\n$EndNodes\n$Elements\n2\n";
    for (const std::int32_t v : {2, 1, 2, 1, 5, 5, 7, 17, 27}) put(b, v); // one triangle
    for (const std::int32_t v : {4, 1, 2, 2, 5, 5, 7, 17, 27, 37}) put(b, v);
    return b + "\n$EndElements\n";
}

inline std::string binary_msh4() {
    std::string b = "$MeshFormat\n4.1 1 8\n";
    put<std::int32_t>(b, 1);
    b += "\n$EndMeshFormat\n$Nodes\n";
    for (const std::uint64_t v : {1, 4, 1, 4}) put(b, v);
    for (const std::int32_t v : {3, 1, 0}) put(b, v);
    put<std::uint64_t>(b, 4);
    for (const std::uint64_t v : {4, 3, 2, 1}) put(b, v); // numbers in any order
    for (const double c : {0., 0., 1., 0., 1., 0., 1., 0., 0., 0., 0., 0.}) put(b, c);
    b += "\n$EndNodes\n$Elements\n";
    for (const std::uint64_t v : {1, 1, 1, 1}) put(b, v);
    for (const std::int32_t v : {3, 1, 4}) put(b, v);
    for (const std::uint64_t v : {1, 1, 1, 2, 3, 4}) put(b, v);
    return b + "\n$EndElements\n";
}

inline std::string vtk_binary(bool five) {
    std::string b =
        "# vtk DataFile Version " + std::string(five ? "5.1" : "3.0") + "\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n";
    for (const double c : {0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.}) put(b, c, true);
    if (five) {
        b += "\nMETADATA\nINFORMATION 0\n\nCELLS 2 4\nOFFSETS vtktypeint64\n";
        for (const std::int64_t v : {0, 4}) put(b, v, true);
        b += "\nCONNECTIVITY vtktypeint64\n";
        for (const std::int64_t v : {0, 1, 2, 3}) put(b, v, true);
    } else {
        b += "\nCELLS 1 5\n";
        for (const std::int32_t v : {4, 0, 1, 2, 3}) put(b, v, true);
    }
    b += "\nCELL_TYPES 1\n";
    put<std::int32_t>(b, 10, true);
    return b + "\nPOINT_DATA 4\nwhatever follows\n";
}

enum class VtuEncoding { Inline, InlineApart, Compressed, AppendedBase64, AppendedRaw };

inline std::string vtu(VtuEncoding encoding, bool big) {
    std::string points, connectivity, ends, types;
    for (const float c : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f}) put(points, c, big);
    for (const std::int32_t v : {0, 1, 2, 3}) put(connectivity, v, big);
    put<std::int64_t>(ends, 4, big);
    types = "\x0A";
    std::string appended;
    const auto pack = [&](const std::string& data) {
        std::string head;
        if (encoding == VtuEncoding::Compressed) {
            const std::string a = deflate_bytes(data.substr(0, data.size() / 2), 15), c = deflate_bytes(data.substr(data.size() / 2), 15);
            if (data.size() < 2) { // a single block
                for (const std::uint64_t v : {std::uint64_t{1}, std::uint64_t{data.size()}, std::uint64_t{0}, std::uint64_t{c.size()}})
                    put(head, v, big);
                return base64(head) + base64(c);
            }
            for (const std::uint64_t v :
                 {std::uint64_t{2}, std::uint64_t{data.size() / 2}, std::uint64_t{0}, std::uint64_t{a.size()}, std::uint64_t{c.size()}})
                put(head, v, big);
            return base64(head) + base64(a + c);
        }
        put<std::uint64_t>(head, data.size(), big);
        if (encoding == VtuEncoding::AppendedRaw) return head + data;
        return encoding == VtuEncoding::InlineApart ? base64(head) + "\n" + base64(data) : base64(head + data);
    };
    const bool is_appended = encoding == VtuEncoding::AppendedBase64 || encoding == VtuEncoding::AppendedRaw;
    const auto array = [&](const std::string& type, const std::string& name, const std::string& data) {
        std::string tag = "<DataArray type=\"" + type + "\" Name=\"" + name + "\" NumberOfComponents=\"3\" format=\"";
        if (!is_appended) return tag + "binary\">\n" + pack(data) + "\n</DataArray>\n";
        tag += "appended\" offset=\"" + std::to_string(appended.size()) + "\"/>\n";
        appended += pack(data);
        return tag;
    };
    std::string xml = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" header_type=\"UInt64\" byte_order=\"";
    xml += big ? "BigEndian\"" : "LittleEndian\"";
    if (encoding == VtuEncoding::Compressed) xml += " compressor=\"vtkZLibDataCompressor\"";
    xml += ">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\n<Points>\n" + array("Float32", "Points", points);
    xml += "</Points>\n<Cells>\n" + array("Int32", "connectivity", connectivity) + array("Int64", "offsets", ends) +
           array("UInt8", "types", types);
    xml += "</Cells>\n</Piece>\n</UnstructuredGrid>\n";
    if (is_appended)
        xml += std::string("<AppendedData encoding=\"") + (encoding == VtuEncoding::AppendedRaw ? "raw" : "base64") + "\">\n_" + appended +
               "\n</AppendedData>\n";
    return xml + "</VTKFile>\n";
}

inline std::vector<Sample> tet_samples() {
    return {
        {"gmsh1.msh", "$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n2\n1 2 1 1 3 1 2 3\n2 4 1 1 4 1 2 3 4\n$ENDELM\n"},
        {"gmsh2.msh",
         "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"liver\"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n"
         "3 0 1 0\n400 0 0 1\n$EndNodes\n$Elements\n2\n1 15 2 0 1 1\n2 4 2 0 1 1 2 3 400\n$EndElements\n"},
        {"gmsh2_binary.msh", binary_msh2()},
        {"gmsh4.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 4 1 4\n2 1 1 1\n1\n0 0 0 0.5 0.5\n3 1 0 3\n2\n3\n4\n1 0 0\n0 1 0\n0 "
                      "0 1\n$EndNodes\n"
                      "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n"},
        {"gmsh4_binary.msh", binary_msh4()},
        {"legacy.vtk",
         "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME 1 1 double\n0.5\nPOINTS 4 float\n"
         "0 0 0 1 0 0\n0 1 0 0 0 1\nCELLS 2 7\n4 0 1 2 3\n1 0\nCELL_TYPES 2\n10 1\n"},
        {"legacy_binary.vtk", vtk_binary(false)},
        {"legacy5_binary.vtk", vtk_binary(true)},
        {"text.vtu",
         "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points>\n"
         "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>"
         "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>"
         "<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>"
         "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"},
        {"inline.vtu", vtu(VtuEncoding::Inline, false)},
        {"inline_big.vtu", vtu(VtuEncoding::Inline, true)},
        {"inline_apart.vtu", vtu(VtuEncoding::InlineApart, false)},
        {"compressed.vtu", vtu(VtuEncoding::Compressed, false)},
        {"appended64.vtu", vtu(VtuEncoding::AppendedBase64, false)},
        {"appended_raw.vtu", vtu(VtuEncoding::AppendedRaw, true)},
        {"medit.mesh", "MeshVersionFormatted 2\nDimension\n3\n# corners\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTriangles\n1\n1 "
                       "2 3 9\nTetrahedra\n1\n1 2 3 4 0\nEnd\n"},
        {"vega.veg", "# Vega\n*VERTICES\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n*ELEMENTS\nTET\n1 4 0\n1 1 2 3 4\n*MATERIAL m\nENU, "
                     "1000, 1e7, 0.45\n"},
    };
}

inline std::string binary_stl() {
    std::string b(80, 'x');
    b.replace(0, 5, "solid"); // as many writers do
    put<std::uint32_t>(b, 4);
    const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const auto& t : {std::array{0, 2, 1}, std::array{0, 1, 3}, std::array{0, 3, 2}, std::array{1, 2, 3}}) {
        for (int i = 0; i < 3; ++i) put(b, 0.f);
        for (const int v : t)
            for (const float c : corners[v]) put(b, c);
        put<std::uint16_t>(b, 0);
    }
    return b;
}

inline std::string text_stl() {
    std::string text = "solid a tetrahedron\n";
    const char* corners[4] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
    for (const auto& t : {std::array{0, 2, 1}, std::array{0, 1, 3}, std::array{0, 3, 2}, std::array{1, 2, 3}}) {
        text += "  facet normal 0 0 0\n    outer loop\n";
        for (const int v : t) text += std::string("      vertex ") + corners[v] + "\n";
        text += "    endloop\n  endfacet\n";
    }
    return text + "endsolid a tetrahedron\n";
}

inline std::string binary_ply(bool big) {
    std::string b = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                    "_endian 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\n"
                    "element face 4\nproperty uchar flags\nproperty list uchar uint vertex_indices\nend_header\n";
    const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const auto& c : corners) {
        put(b, c[0], big);
        put<double>(b, c[1], big);
        put(b, c[2], big);
        b += 'r';
    }
    for (const auto& t : {std::array{0, 2, 1}, std::array{0, 1, 3}, std::array{0, 3, 2}, std::array{1, 2, 3}}) {
        b += "f\x03";
        for (const int v : t) put<std::uint32_t>(b, static_cast<std::uint32_t>(v), big);
    }
    return b;
}

inline std::vector<Sample> surface_samples() {
    return {
        {"plain.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"},
        {"rich.obj", "# c\r\nmtllib x.mtl\r\no tet\r\nv 0 0 0 1 nan nan\r\nv +1.0 0 0\r\nv 0 1e0 0\r\nv 0 -0 1\r\nvt 0 0\r\nvn 0 0 "
                     "1\r\nusemtl m\r\ns off\r\n"
                     "f 1/1/1 3/1/1 2/1/1\r\nf -4//1 -3//1 \\\r\n -1//1\r\nf 1/1 4/1 3/1\r\nf 2// 3// 4//\r\nl 1 2\r\n"},
        {"text.ply",
         "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty list uchar int extra\n"
         "element edge 1\nproperty int a\nelement face 4\nproperty list uchar int vertex_index\nend_header\n"
         "0 0 0 0\n1 0 0 2 7 8\n0 1 0 0\n0 0 1 0\n5\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"},
        {"little.ply", binary_ply(false)},
        {"big.ply", binary_ply(true)},
        {"text.stl", text_stl()},
        {"binary.STL", binary_stl()},
        {"plain.off", "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3 255 0 0\n3 0 3 2\n3 1 2 3"},
        {"colour.off",
         "COFF 4 4 0 # counts\n\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n0 0 1 1 1 1 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"},
        {"poly.vtk", "# vtk DataFile Version 4.2\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\nLINES 1 3\n2 0 1\n"
                     "POLYGONS 2 8\n3 0 2 1\n3 0 1 3\nTRIANGLE_STRIPS 1 5\n4 0 3 2 1\nCELL_DATA 3\n"},
        {"text.vtp",
         "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"4\" NumberOfPolys=\"4\"><Points>"
         "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>"
         "<Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 2 1 0 1 3 0 3 2 1 2 3</DataArray>"
         "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3 6 9 12</DataArray></Polys></Piece></PolyData></VTKFile>"},
    };
}

} // namespace trocar::engine::test
