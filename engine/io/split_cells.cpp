#include "engine/io/split_cells.hpp"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

namespace trocar::engine {
namespace {

/// Corners of a face, counter-clockwise seen from outside; the last is kNone where there are three.
using Face = std::array<std::uint8_t, 4>;
constexpr std::uint8_t kNone = 255;
constexpr std::array<Face, 6> kHexahedron{{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
constexpr std::array<Face, 5> kPrism{{{0, 2, 1, kNone}, {3, 4, 5, kNone}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}};
constexpr std::array<Face, 5> kPyramid{{{0, 3, 2, 1}, {0, 1, 4, kNone}, {1, 2, 4, kNone}, {2, 3, 4, kNone}, {3, 0, 4, kNone}}};

/// The cell as tetrahedra from its lowest node to the triangles of the faces that it is not on.
void add_cell(std::span<const Index> corners, std::span<const Face> faces, std::vector<Tet>& tets) {
    const Index lowest = *std::min_element(corners.begin(), corners.end());
    for (const Face& face : faces) {
        const std::size_t size = face[3] == kNone ? 3 : 4;
        std::size_t first = 0;
        bool holds_lowest = false;
        for (std::size_t k = 0; k < size; ++k) {
            if (corners[face[k]] < corners[face[first]]) first = k;
            holds_lowest |= corners[face[k]] == lowest;
        }
        if (holds_lowest) continue;
        const Index a = corners[face[first]];
        for (std::size_t k = 1; k + 1 < size; ++k) {
            const Index b = corners[face[(first + k) % size]], c = corners[face[(first + k + 1) % size]];
            if (a != b && b != c && c != a) tets.push_back({lowest, a, b, c});
        }
    }
}

double six_volumes(const TetMesh& mesh, const Tet& t) {
    const Vec3& o = mesh.vertices[t[0]];
    return (mesh.vertices[t[1]] - o).dot((mesh.vertices[t[2]] - o).cross(mesh.vertices[t[3]] - o));
}

/// A kind of cells, turned round as a whole where not one of them is positive.
class KindOfCells {
public:
    explicit KindOfCells(TetMesh& mesh, std::size_t first) : mesh_(mesh), begin_(first), first_(first) {}

    /// The tetrahedra that were added since the last call are one cell.
    void end_cell(std::size_t end) {
        double volume = 0.0;
        for (; first_ < end; ++first_) volume += six_volumes(mesh_, mesh_.tets[first_]);
        any_positive_ |= volume > 0.0;
        any_negative_ |= volume < 0.0;
    }
    void orient() {
        if (!any_negative_ || any_positive_) return;
        for (std::size_t t = begin_; t < first_; ++t) std::swap(mesh_.tets[t][2], mesh_.tets[t][3]);
    }

private:
    TetMesh& mesh_;
    std::size_t begin_, first_;
    bool any_positive_ = false, any_negative_ = false;
};

/// places  of the cells; place_of_tet  goes on with those of their tetrahedra
template <std::size_t kCorners>
void add_cells(const std::vector<std::array<Index, kCorners>>& cells, std::span<const Face> faces, std::span<const std::size_t> places, TetMesh& mesh,
               std::vector<std::size_t>& place_of_tet) {
    KindOfCells kind(mesh, mesh.tets.size());
    for (std::size_t c = 0; c < cells.size(); ++c) {
        add_cell(cells[c], faces, mesh.tets);
        kind.end_cell(mesh.tets.size());
        if (!places.empty()) place_of_tet.resize(mesh.tets.size(), places[c]);
    }
    kind.orient();
}

void orient_tets(TetMesh& mesh) {
    KindOfCells kind(mesh, 0);
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) kind.end_cell(t + 1);
    kind.orient();
}

} // namespace

TetMesh join_cells(TetMesh&& tets, const MixedCells& cells, BesideTets* beside) {
    TetMesh mesh = std::move(tets);
    orient_tets(mesh);
    const std::size_t own = mesh.tets.size();
    std::vector<std::size_t> place_of_tet = cells.places.tets;
    add_cells(cells.hexahedra, kHexahedron, cells.places.hexahedra, mesh, place_of_tet);
    add_cells(cells.prisms, kPrism, cells.places.prisms, mesh, place_of_tet);
    add_cells(cells.pyramids, kPyramid, cells.places.pyramids, mesh, place_of_tet);
    if (beside == nullptr) return mesh;
    beside->split = {cells.hexahedra.size(), cells.prisms.size(), cells.pyramids.size(), mesh.tets.size() - own};
    beside->place_of_tet = std::move(place_of_tet);
    return mesh;
}

std::string describe_split(const SplitCells& split) {
    std::string what;
    const auto add = [&](std::size_t count, const char* one, const char* many) {
        if (count > 0) what += fmt::format("{}{} {}", what.empty() ? "" : ", ", count, count == 1 ? one : many);
    };
    add(split.hexahedra, "hexahedron", "hexahedra");
    add(split.prisms, "prism", "prisms");
    add(split.pyramids, "pyramid", "pyramids");
    return what.empty() ? what : fmt::format("{} split into {} tetrahedra", what, split.tets);
}

} // namespace trocar::engine
