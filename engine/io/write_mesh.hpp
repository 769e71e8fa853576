// Mesh files out: OBJ for everybody, VTP, VTU and PVD for ParaView. All complete or not there (atomic_file.hpp).
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace trocar::engine {

/// A surface as spans, so that current positions can be written with rest triangles without a copy.
struct SurfaceView {
    std::span<const Vec3> vertices;
    std::span<const Triangle> triangles;
    SurfaceView(std::span<const Vec3> v, std::span<const Triangle> t) : vertices(v), triangles(t) {}
    SurfaceView(const TriMesh& mesh) : vertices(mesh.vertices), triangles(mesh.triangles) {} // NOLINT(google-explicit-constructor)
};

struct TetView {
    std::span<const Vec3> vertices;
    std::span<const Tet> tets;
    TetView(std::span<const Vec3> v, std::span<const Tet> t) : vertices(v), tets(t) {}
    TetView(const TetMesh& mesh) : vertices(mesh.vertices), tets(mesh.tets) {} // NOLINT(google-explicit-constructor)
};

/// Named numbers at vertices or cells, as ParaView's arrays: values[i * components + c].
struct DataArray {
    std::string name;
    std::size_t components = 1;
    std::span<const double> values;
};

/// Arrays of a written mesh.
struct MeshData {
    std::span<const DataArray> points; // one tuple per vertex
    std::span<const DataArray> cells;  // one tuple per triangle or tetrahedron
};

/// fails     BadMesh: a cell names a vertex that is not there; BadValue: an array's length does not fit the mesh; CannotWrite: see
/// write_file_atomically
[[nodiscard]] Result<void> write_obj(const std::filesystem::path& path, const SurfaceView& surface);
[[nodiscard]] Result<void> write_vtp(const std::filesystem::path& path, const SurfaceView& surface, const MeshData& data = {});
/// Binary STL: numbers in single precision, no shared vertices.
[[nodiscard]] Result<void> write_stl(const std::filesystem::path& path, const SurfaceView& surface);
/// Lines as lists of point ids; data per point and per line.
[[nodiscard]] Result<void> write_vtp_lines(const std::filesystem::path& path, std::span<const Vec3> points,
                                           std::span<const std::vector<Index>> lines, const MeshData& data = {});
/// One line through all points, in their order; no cell data.
[[nodiscard]] Result<void> write_vtp_line(const std::filesystem::path& path, std::span<const Vec3> line, std::span<const DataArray> points);
[[nodiscard]] Result<void> write_vtu(const std::filesystem::path& path, const TetView& mesh, const MeshData& data = {});

/// A time series for ParaView: files with the time they show. Written anew at every write(), so that a run that is
/// cut off leaves a readable collection of what it had.
class PvdCollection {
public:
    explicit PvdCollection(std::filesystem::path path) : path_(std::move(path)) {}
    /// file is relative to the collection's own folder; part tells bodies apart.
    void add(double time, std::string file, unsigned part = 0);
    [[nodiscard]] Result<void> write() const;

private:
    struct Entry {
        double time;
        std::string file;
        unsigned part;
    };
    std::filesystem::path path_;
    std::vector<Entry> entries_;
};

} // namespace trocar::engine
