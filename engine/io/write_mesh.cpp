// VTK XML with raw appended data: fast to write, exact, and what ParaView reads fastest.
#include "engine/io/write_mesh.hpp"

#include "engine/io/atomic_file.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <iterator>

namespace trocar::engine {
namespace {

constexpr std::uint8_t kTetrahedronCell = 10; // vtkCellType.h

std::string escape(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '&')
            out += "&amp;";
        else if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else if (c == '"')
            out += "&quot;";
        else
            out += c;
    }
    return out;
}

/// Builds the XML and, apart from it, the appended bytes; each array begins with its size in 64 bits.
class VtkWriter {
public:
    explicit VtkWriter(const char* kind) : kind_(kind) {
        static_assert(std::endian::native == std::endian::little, "the file says LittleEndian");
        xml_ = fmt::format("<?xml version=\"1.0\"?>\n<VTKFile type=\"{0}\" version=\"1.0\" byte_order=\"LittleEndian\" "
                           "header_type=\"UInt64\">\n<{0}>\n",
                           kind);
    }

    void text(std::string_view part) { xml_ += part; }

    template <class T>
    void array(const char* type, const std::string& name, std::size_t components, const T* values, std::size_t count) {
        xml_ += fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n", type,
                            escape(name), components, bytes_.size());
        const std::uint64_t size = count * sizeof(T);
        bytes_.append(reinterpret_cast<const char*>(&size), sizeof size);
        if (size > 0) bytes_.append(reinterpret_cast<const char*>(values), size);
    }

    void points(std::span<const Vec3> vertices) {
        static_assert(sizeof(Vec3) == 3 * sizeof(double));
        xml_ += "<Points>\n";
        array("Float64", "Points", 3, reinterpret_cast<const double*>(vertices.data()), 3 * vertices.size());
        xml_ += "</Points>\n";
    }

    template <class Cell>
    void connectivity(std::span<const Cell> cells) {
        std::vector<std::int64_t> ids, ends;
        for (const Cell& cell : cells) {
            ids.insert(ids.end(), cell.begin(), cell.end());
            ends.push_back(static_cast<std::int64_t>(ids.size()));
        }
        array("Int64", "connectivity", 1, ids.data(), ids.size());
        array("Int64", "offsets", 1, ends.data(), ends.size());
    }

    void data(const char* where, std::span<const DataArray> arrays) {
        if (arrays.empty()) return;
        xml_ += fmt::format("<{}>\n", where);
        for (const DataArray& a : arrays) array("Float64", a.name, a.components, a.values.data(), a.values.size());
        xml_ += fmt::format("</{}>\n", where);
    }

    [[nodiscard]] std::string finish() && {
        xml_ += fmt::format("</Piece>\n</{}>\n<AppendedData encoding=\"raw\">\n_", kind_);
        xml_ += bytes_;
        xml_ += "\n</AppendedData>\n</VTKFile>\n";
        return std::move(xml_);
    }

private:
    const char* kind_;
    std::string xml_, bytes_;
};

Result<void> check(std::span<const DataArray> arrays, std::size_t tuples, const std::filesystem::path& path) {
    for (const DataArray& a : arrays)
        if (a.components == 0 || a.values.size() != a.components * tuples)
            return Error{ErrorCode::BadValue,
                         fmt::format("array '{}' has {} numbers; {} x {} are wanted", a.name, a.values.size(), tuples, a.components),
                         path.string()};
    return {};
}

/// A reader of the file would index beyond its vertices.
template <class Cell>
Result<void> check_cells(std::span<const Cell> cells, std::size_t vertices, const char* kind, const std::filesystem::path& path) {
    for (std::size_t i = 0; i < cells.size(); ++i)
        for (const Index v : cells[i])
            if (v >= vertices)
                return Error{ErrorCode::BadMesh, fmt::format("{} {} names vertex {}, expected one of the mesh's {}", kind, i, v, vertices),
                             path.string()};
    return {};
}

} // namespace

Result<void> write_obj(const std::filesystem::path& path, const SurfaceView& surface) {
    if (Result<void> good = check_cells(surface.triangles, surface.vertices.size(), "triangle", path); !good) return good;
    std::string text;
    text.reserve(60 * surface.vertices.size() + 24 * surface.triangles.size());
    const auto out = std::back_inserter(text);
    for (const Vec3& v : surface.vertices) fmt::format_to(out, "v {} {} {}\n", v.x(), v.y(), v.z());
    for (const Triangle& t : surface.triangles) fmt::format_to(out, "f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    return write_file_atomically(path, text);
}

Result<void> write_vtp(const std::filesystem::path& path, const SurfaceView& surface, const MeshData& data) {
    if (Result<void> good = check_cells(surface.triangles, surface.vertices.size(), "triangle", path); !good) return good;
    if (Result<void> good = check(data.points, surface.vertices.size(), path); !good) return good;
    if (Result<void> good = check(data.cells, surface.triangles.size(), path); !good) return good;
    VtkWriter writer("PolyData");
    writer.text(fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfPolys=\"{}\">\n", surface.vertices.size(), surface.triangles.size()));
    writer.data("PointData", data.points);
    writer.data("CellData", data.cells);
    writer.points(surface.vertices);
    writer.text("<Polys>\n");
    writer.connectivity(surface.triangles);
    writer.text("</Polys>\n");
    return write_file_atomically(path, std::move(writer).finish());
}

Result<void> write_stl(const std::filesystem::path& path, const SurfaceView& surface) {
    if (Result<void> good = check_cells(surface.triangles, surface.vertices.size(), "triangle", path); !good) return good;
    static_assert(std::endian::native == std::endian::little, "the format is little-endian");
    std::string bytes(80, ' ');
    const auto add = [&bytes](const auto& number) { bytes.append(reinterpret_cast<const char*>(&number), sizeof number); };
    add(static_cast<std::uint32_t>(surface.triangles.size()));
    for (const Triangle& t : surface.triangles) {
        const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
        const Vec3 area = (b - a).cross(c - a), normal = area.norm() > 0.0 ? Vec3(area.normalized()) : Vec3(Vec3::Zero());
        for (const Vec3& v : {normal, a, b, c})
            for (int axis = 0; axis < 3; ++axis) add(static_cast<float>(v[axis]));
        add(std::uint16_t{0});
    }
    return write_file_atomically(path, bytes);
}

Result<void> write_vtp_lines(const std::filesystem::path& path, std::span<const Vec3> points, std::span<const std::vector<Index>> lines,
                             const MeshData& data) {
    if (Result<void> good = check_cells(lines, points.size(), "line", path); !good) return good;
    if (Result<void> good = check(data.points, points.size(), path); !good) return good;
    if (Result<void> good = check(data.cells, lines.size(), path); !good) return good;
    VtkWriter writer("PolyData");
    writer.text(fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfLines=\"{}\">\n", points.size(), lines.size()));
    writer.data("PointData", data.points);
    writer.data("CellData", data.cells);
    writer.points(points);
    writer.text("<Lines>\n");
    writer.connectivity(lines);
    writer.text("</Lines>\n");
    return write_file_atomically(path, std::move(writer).finish());
}

Result<void> write_vtp_line(const std::filesystem::path& path, std::span<const Vec3> line, std::span<const DataArray> points) {
    std::array<std::vector<Index>, 1> whole;
    for (std::size_t i = 0; i < line.size(); ++i) whole[0].push_back(static_cast<Index>(i));
    return write_vtp_lines(path, line, whole, {points, {}});
}

Result<void> write_vtu(const std::filesystem::path& path, const TetView& mesh, const MeshData& data) {
    if (Result<void> good = check_cells(mesh.tets, mesh.vertices.size(), "tetrahedron", path); !good) return good;
    if (Result<void> good = check(data.points, mesh.vertices.size(), path); !good) return good;
    if (Result<void> good = check(data.cells, mesh.tets.size(), path); !good) return good;
    VtkWriter writer("UnstructuredGrid");
    writer.text(fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", mesh.vertices.size(), mesh.tets.size()));
    writer.data("PointData", data.points);
    writer.data("CellData", data.cells);
    writer.points(mesh.vertices);
    writer.text("<Cells>\n");
    writer.connectivity(mesh.tets);
    const std::vector<std::uint8_t> types(mesh.tets.size(), kTetrahedronCell);
    writer.array("UInt8", "types", 1, types.data(), types.size());
    writer.text("</Cells>\n");
    return write_file_atomically(path, std::move(writer).finish());
}

void PvdCollection::add(double time, std::string file, unsigned part) { entries_.push_back({time, std::move(file), part}); }

Result<void> PvdCollection::write() const {
    std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n";
    for (const Entry& entry : entries_)
        fmt::format_to(std::back_inserter(text), "<DataSet timestep=\"{}\" part=\"{}\" file=\"{}\"/>\n", entry.time, entry.part,
                       escape(entry.file));
    return write_file_atomically(path_, text + "</Collection>\n</VTKFile>\n");
}

} // namespace trocar::engine
