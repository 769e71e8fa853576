#include "fem/mesh/lattice.hpp"

#include "base/inside.hpp"
#include "base/topology.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

namespace trocar::fem {

namespace {

double area_of(const TriMesh& surface) noexcept {
    double area = 0.0;
    for (const Triangle& t : surface.triangles)
        area += 0.5 * (surface.vertices[t[1]] - surface.vertices[t[0]]).cross(surface.vertices[t[2]] - surface.vertices[t[0]]).norm();
    return area;
}

double volume_of(const TriMesh& surface) noexcept {
    double six = 0.0;
    for (const Triangle& t : surface.triangles) six += surface.vertices[t[0]].dot(surface.vertices[t[1]].cross(surface.vertices[t[2]]));
    return six / 6.0;
}

double tet_volume(const TetMesh& mesh, const Tet& t) noexcept {
    const Vec3& o = mesh.vertices[t[0]];
    return (mesh.vertices[t[1]] - o).dot((mesh.vertices[t[2]] - o).cross(mesh.vertices[t[3]] - o)) / 6.0;
}

/// Negative for an inverted tet.
double least_altitude(const TetMesh& mesh, const Tet& t) noexcept {
    const Vec3& o = mesh.vertices[t[0]];
    const Vec3 a = mesh.vertices[t[1]] - o, b = mesh.vertices[t[2]] - o, c = mesh.vertices[t[3]] - o;
    const double largest_sq =
        std::max({a.cross(b).squaredNorm(), a.cross(c).squaredNorm(), b.cross(c).squaredNorm(), (b - a).cross(c - a).squaredNorm()});
    return a.dot(b.cross(c)) / std::sqrt(largest_sq);
}

/// Share of a tet in which a linear function with these corner values is negative, by samples.
double filled_share(const double value[4]) noexcept {
    constexpr int kOrder = 5; // 56 samples
    int inside = 0, all = 0;
    for (int i = 0; i <= kOrder; ++i)
        for (int j = 0; i + j <= kOrder; ++j)
            for (int k = 0; i + j + k <= kOrder; ++k, ++all)
                inside += i * value[0] + j * value[1] + k * value[2] + (kOrder - i - j - k) * value[3] < 0.0;
    return static_cast<double>(inside) / all;
}

class Lattice {
public:
    Lattice(const TriMesh& surface, const LatticeOptions& options) : options_(options), inside_(surface) {
        const Box3 box = surface.bounds();
        for (int axis = 0; axis < 3; ++axis) {
            count_[axis] = static_cast<Index>(std::ceil((box.hi[axis] - box.lo[axis]) / options.cell)) + 2;
            origin_[axis] = 0.5 * (box.lo[axis] + box.hi[axis] - count_[axis] * options.cell);
        }
    }

    TetMesh fill() {
        add_points();
        TetMesh mesh;
        mesh.vertices = points_;
        for (int axis = 0; axis < 3; ++axis)
            for (Index k = 0; k < count_[2]; ++k)
                for (Index j = 0; j < count_[1]; ++j)
                    for (Index i = 0; i < count_[0]; ++i) add_face(axis, {i, j, k}, mesh);
        return mesh;
    }

    /// Draws boundary nodes to the surface, and inner nodes to the middle of their neighbours where that helps the thinnest tet.
    void fit(TetMesh& mesh, LatticeMesh& report) {
        const double least = options_.least_altitude * options_.cell / std::sqrt(2.0); // an undeformed tet's altitude
        std::vector<std::vector<Index>> around(mesh.vertices.size());
        for (Index tet = 0; tet < mesh.tets.size(); ++tet)
            for (const Index node : mesh.tets[tet]) around[node].push_back(tet);
        std::vector<bool> outside(mesh.vertices.size(), false);
        for (const Triangle& t : boundary_surface(mesh).triangles)
            for (const Index node : t) outside[node] = true;
        for (unsigned sweep = 0; sweep < options_.sweeps; ++sweep)
            for (Index node = 0; node < mesh.vertices.size(); ++node) {
                if (outside[node])
                    draw_to_surface(mesh, around[node], node, least);
                else
                    relax(mesh, around[node], node);
            }
        measure_fit(mesh, outside, report);
    }

private:
    Index corner_id(Index i, Index j, Index k) const noexcept { return (k * (count_[1] + 1) + j) * (count_[0] + 1) + i; }
    Index centre_id(Index i, Index j, Index k) const noexcept { return centres_ + (k * count_[1] + j) * count_[0] + i; }

    void add_points() {
        const double a = options_.cell;
        for (Index k = 0; k <= count_[2]; ++k)
            for (Index j = 0; j <= count_[1]; ++j)
                for (Index i = 0; i <= count_[0]; ++i) points_.push_back(origin_ + a * Vec3(i, j, k));
        centres_ = static_cast<Index>(points_.size());
        for (Index k = 0; k < count_[2]; ++k)
            for (Index j = 0; j < count_[1]; ++j)
                for (Index i = 0; i < count_[0]; ++i) points_.push_back(origin_ + a * Vec3(i + 0.5, j + 0.5, k + 0.5));
        for (const Vec3& p : points_) distance_.push_back(inside_.signed_distance(p));
    }

    /// The four tets around the face that a cube shares with its neighbour along an axis: two centres, an edge of the face.
    void add_face(int axis, const std::array<Index, 3>& cube, TetMesh& mesh) const {
        std::array<Index, 3> next = cube;
        if (++next[static_cast<std::size_t>(axis)] >= count_[static_cast<std::size_t>(axis)]) return;
        const std::size_t u = static_cast<std::size_t>(axis + 1) % 3, v = static_cast<std::size_t>(axis + 2) % 3;
        Index corner[4];
        for (std::size_t m = 0; m < 4; ++m) {
            std::array<Index, 3> at = next;
            at[u] += m == 1 || m == 2;
            at[v] += m >= 2;
            corner[m] = corner_id(at[0], at[1], at[2]);
        }
        for (std::size_t m = 0; m < 4; ++m) {
            Tet tet{centre_id(cube[0], cube[1], cube[2]), centre_id(next[0], next[1], next[2]), corner[m], corner[(m + 1) % 4]};
            const double value[4] = {distance_[tet[0]], distance_[tet[1]], distance_[tet[2]], distance_[tet[3]]};
            if (filled_share(value) < options_.least_fill) continue;
            if (tet_volume(mesh, tet) < 0.0) std::swap(tet[2], tet[3]);
            mesh.tets.push_back(tet);
        }
    }

    static double thinnest(const TetMesh& mesh, const std::vector<Index>& tets) noexcept {
        double least = std::numeric_limits<double>::infinity();
        for (const Index tet : tets) least = std::min(least, least_altitude(mesh, mesh.tets[tet]));
        return least;
    }

    void draw_to_surface(TetMesh& mesh, const std::vector<Index>& tets, Index node, double least) const {
        const auto nearest = inside_.tree().closest(mesh.vertices[node]);
        if (!nearest) return;
        const Vec3 from = mesh.vertices[node];
        for (const double share : {1.0, 0.7, 0.4, 0.2}) {
            mesh.vertices[node] = from + share * (nearest->point - from);
            if (thinnest(mesh, tets) >= least) return;
        }
        mesh.vertices[node] = from;
    }

    void relax(TetMesh& mesh, const std::vector<Index>& tets, Index node) const {
        Vec3 sum = Vec3::Zero();
        for (const Index tet : tets)
            for (const Index other : mesh.tets[tet]) sum += mesh.vertices[other] - mesh.vertices[node];
        const Vec3 from = mesh.vertices[node];
        const double before = thinnest(mesh, tets);
        mesh.vertices[node] = from + 0.5 * sum / (3.0 * static_cast<double>(tets.size()));
        if (thinnest(mesh, tets) <= before) mesh.vertices[node] = from;
    }

    void measure_fit(const TetMesh& mesh, const std::vector<bool>& outside, LatticeMesh& report) const {
        std::size_t boundary = 0, fitted = 0;
        for (Index node = 0; node < mesh.vertices.size(); ++node) {
            if (!outside[node]) continue;
            const auto nearest = inside_.tree().closest(mesh.vertices[node]);
            const double distance = nearest ? nearest->distance : 0.0;
            report.farthest = std::max(report.farthest, distance);
            ++boundary;
            fitted += distance < 1e-6 * options_.cell;
        }
        report.fitted_share = boundary > 0 ? static_cast<double>(fitted) / static_cast<double>(boundary) : 0.0;
    }

    LatticeOptions options_;
    InsideTest inside_;
    std::array<Index, 3> count_{};
    Vec3 origin_ = Vec3::Zero();
    Index centres_ = 0; // id of the first cube's centre
    std::vector<Vec3> points_;
    std::vector<double> distance_;
};

/// Root of every tet's part, parts joined through faces.
std::vector<Index> find_parts(const TetMesh& mesh) {
    std::vector<Index> root(mesh.tets.size());
    std::iota(root.begin(), root.end(), Index{0});
    const auto find = [&](Index tet) {
        while (root[tet] != tet) tet = root[tet] = root[root[tet]];
        return tet;
    };
    std::vector<std::pair<Triangle, Index>> faces;
    for (Index tet = 0; tet < mesh.tets.size(); ++tet)
        for (std::size_t skip = 0; skip < 4; ++skip) {
            Triangle face{};
            for (std::size_t k = 0, m = 0; k < 4; ++k)
                if (k != skip) face[m++] = mesh.tets[tet][k];
            std::sort(face.begin(), face.end());
            faces.emplace_back(face, tet);
        }
    std::sort(faces.begin(), faces.end());
    for (std::size_t i = 1; i < faces.size(); ++i)
        if (faces[i].first == faces[i - 1].first)
            root[std::max(find(faces[i].second), find(faces[i - 1].second))] = std::min(find(faces[i].second), find(faces[i - 1].second));
    for (Index tet = 0; tet < root.size(); ++tet) root[tet] = find(tet);
    return root;
}

/// Lattice points that no tet uses go; the others keep their order.
void drop_spare_nodes(TetMesh& mesh) {
    std::vector<Index> to(mesh.vertices.size(), kNoIndex);
    for (const Tet& t : mesh.tets)
        for (const Index node : t) to[node] = 0;
    Index kept = 0;
    for (std::size_t node = 0; node < to.size(); ++node) {
        if (to[node] == kNoIndex) continue;
        mesh.vertices[kept] = mesh.vertices[node];
        to[node] = kept++;
    }
    mesh.vertices.resize(kept);
    for (Tet& t : mesh.tets)
        for (Index& node : t) node = to[node];
}

/// Drops tets on a node that fewer than so many tets share, until none is left: a light node on a stiff corner limits the stable step of
/// the whole body.
void drop_spikes(TetMesh& mesh, unsigned least_tets) {
    std::vector<unsigned> around(mesh.vertices.size());
    for (std::size_t before = 0; before != mesh.tets.size();) {
        before = mesh.tets.size();
        std::fill(around.begin(), around.end(), 0u);
        for (const Tet& t : mesh.tets)
            for (const Index node : t) ++around[node];
        std::erase_if(mesh.tets,
                      [&](const Tet& t) { return std::any_of(t.begin(), t.end(), [&](Index node) { return around[node] < least_tets; }); });
    }
}

/// Keeps the part with the most tets (of equals the first); loose parts would float away.
void keep_largest_part(TetMesh& mesh, LatticeMesh& report) {
    const std::vector<Index> root = find_parts(mesh);
    std::vector<std::size_t> size(mesh.tets.size(), 0);
    for (const Index r : root) ++size[r];
    const auto largest = static_cast<Index>(std::max_element(size.begin(), size.end()) - size.begin());
    std::size_t kept = 0;
    for (std::size_t tet = 0; tet < mesh.tets.size(); ++tet) {
        if (root[tet] == largest)
            mesh.tets[kept++] = mesh.tets[tet];
        else if (root[tet] == tet)
            ++report.islands;
    }
    report.island_tets = mesh.tets.size() - kept;
    mesh.tets.resize(kept);
}

} // namespace

double find_lattice_cell(const TriMesh& surface, std::size_t triangles) noexcept {
    const double edge = std::sqrt(4.0 / std::sqrt(3.0) * area_of(surface) / static_cast<double>(std::max<std::size_t>(triangles, 1)));
    return edge / 0.93; // mean edge of the lattice's tets: two of 1, four of sqrt(3)/2 cells
}

Result<LatticeMesh> make_lattice_mesh(const TriMesh& surface, const LatticeOptions& options) {
    if (surface.triangles.empty()) return Error{.code = ErrorCode::BadMesh, .message = "the surface has no triangles"};
    const Vec3 extent = surface.bounds().hi - surface.bounds().lo;
    if (!(options.cell > 0.0) || !std::isfinite(options.cell))
        return Error{.code = ErrorCode::BadValue,
                     .message = "a lattice cell of " + std::to_string(options.cell) + " m; it must be above 0"};
    const double cells = (extent[0] / options.cell + 2.0) * (extent[1] / options.cell + 2.0) * (extent[2] / options.cell + 2.0);
    if (!(cells <= kMostLatticeCells))
        return Error{.code = ErrorCode::BadValue,
                     .message = "a lattice of " + std::to_string(cells) + " cells; larger cells or fewer surface triangles are needed"};
    const double tets = 12.0 * volume_of(surface) / (options.cell * options.cell * options.cell);
    if (!(tets <= kMostLatticeTets))
        return Error{.code = ErrorCode::BadValue,
                     .message = "a lattice of " + std::to_string(tets) + " tetrahedra; larger cells or fewer surface triangles are needed"};
    LatticeMesh report;
    Lattice lattice(surface, options);
    report.tets = lattice.fill();
    if (report.tets.tets.empty())
        return Error{.code = ErrorCode::BadMesh,
                     .message =
                         "no lattice tetrahedron fits inside: the body is thinner than a cell of " + std::to_string(options.cell) + " m"};
    drop_spikes(report.tets, options.least_tets);
    if (report.tets.tets.empty())
        return Error{.code = ErrorCode::BadMesh,
                     .message = "nothing of the lattice is left without spikes: the body is about as thin as a cell of " +
                                std::to_string(options.cell) + " m"};
    keep_largest_part(report.tets, report);
    drop_spare_nodes(report.tets);
    lattice.fit(report.tets, report);
    double volume = 0.0;
    for (const Tet& t : report.tets.tets) volume += tet_volume(report.tets, t);
    report.volume_ratio = volume / volume_of(surface);
    return report;
}

Result<LatticeMesh> make_lattice_of_nodes(const TriMesh& surface, std::size_t nodes) {
    const auto wanted = static_cast<double>(std::max<std::size_t>(nodes, 1));
    double cell = std::cbrt(2.0 * std::abs(signed_volume(surface)) / wanted); // two nodes a cube
    Result<LatticeMesh> best = Error{.code = ErrorCode::BadMesh, .message = "no lattice"};
    double off = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 5; ++round) {
        Result<LatticeMesh> lattice = make_lattice_mesh(surface, {.cell = cell});
        if (!lattice.ok()) return round == 0 ? std::move(lattice) : std::move(best);
        const double ratio = static_cast<double>(lattice->tets.vertices.size()) / wanted;
        if (std::abs(std::log(ratio)) < off) {
            off = std::abs(std::log(ratio));
            best = std::move(lattice);
        }
        cell *= std::cbrt(ratio);
    }
    return best;
}

} // namespace trocar::fem
