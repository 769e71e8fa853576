#include "engine/io/read_lines.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/io/formats.hpp"
#include "engine/io/mesh_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

using NamedArrays = std::vector<std::pair<std::string, std::vector<double>>>;

Result<std::vector<double>> take_array(NamedArrays& arrays, const char* wanted, std::size_t count, const std::string& name) {
    for (auto& [array, values] : arrays) {
        if (array != wanted) continue;
        if (values.size() != count) return Error{ErrorCode::BadSyntax, fmt::format("the array '{}' has {} numbers; expected {}", wanted, values.size(), count), name};
        return std::move(values);
    }
    return std::vector<double>();
}

/// A line may not come back to a point: a vessel that did would lead into itself.
Result<void> check_line(const std::vector<Index>& line, std::size_t number, const std::string& name) {
    std::vector<Index> sorted = line;
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice == sorted.end()) return {};
    return Error{ErrorCode::BadValue, fmt::format("line {} passes point {} twice; expected centrelines without cycles", number, *twice), name};
}

} // namespace

Result<LineMesh> read_centreline_lines(const std::filesystem::path& path) {
    const std::string name = path.string();
    if (mesh_extension(path) != ".vtp") return Error{ErrorCode::BadUsage, "expected a .vtp file with lines", name};
    const Result<std::string> bytes = read_file_bytes(path);
    if (!bytes.ok()) return bytes.error();
    Result<VtkMesh> vtk = parse_vtk_xml(*bytes, name, true);
    if (!vtk.ok()) return vtk.error();
    LineMesh mesh;
    std::int64_t begin = 0;
    for (const std::int64_t end : vtk->lines.ends) {
        std::vector<Index> line;
        for (; begin < end; ++begin) {
            const std::int64_t id = vtk->lines.connectivity[static_cast<std::size_t>(begin)];
            if (id < 0) return Error{ErrorCode::BadMesh, fmt::format("line {} names a point that is not there", mesh.lines.size()), name};
            line.push_back(static_cast<Index>(id));
        }
        if (const Result<void> good = check_line(line, mesh.lines.size(), name); !good.ok()) return good.error();
        mesh.lines.push_back(std::move(line));
    }
    if (mesh.lines.empty()) return Error{ErrorCode::BadValue, "holds no lines; expected a centreline", name};
    mesh.points = std::move(vtk->points);
    Result<std::vector<double>> radii = take_array(vtk->of_points, "MaximumInscribedSphereRadius", mesh.points.size(), name);
    if (!radii.ok()) return radii.error();
    for (std::size_t i = 0; i < radii->size(); ++i)
        if (!((*radii)[i] >= 0.0) || !std::isfinite((*radii)[i]))
            return Error{ErrorCode::BadValue, fmt::format("point {} has the radius {}; expected finite numbers that are not negative", i, (*radii)[i]), name, 0, 0,
                         "MaximumInscribedSphereRadius"};
    mesh.radii = std::move(*radii);
    for (const auto& [array, values] : {std::pair{"GroupIds", &mesh.groups}, {"CenterlineIds", &mesh.centrelines}, {"TractIds", &mesh.tracts}, {"Blanking", &mesh.blanking}}) {
        Result<std::vector<double>> taken = take_array(vtk->of_cells, array, mesh.lines.size(), name);
        if (!taken.ok()) return taken.error();
        *values = std::move(*taken);
    }
    return mesh;
}

} // namespace trocar::engine
