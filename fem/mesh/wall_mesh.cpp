#include "fem/mesh/wall_mesh.hpp"

#include "fem/mesh/mapped_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace trocar::fem {

namespace {

constexpr double kLeastVolume = 0.3; // [-] of a tetrahedron of an even prism: below, its corners come nearer
constexpr double kThinner = 0.85;    // [-] a try
constexpr double kSteepest = 1.3;    // [-] of thicknesses at the ends of an edge
constexpr double kMostLengthening = 1.5; // [-] of a vertex's way outwards over the thickness, on ridges

/// Turns normals towards those triangles that they hardly see: on a sharp fold the mean over the angles may leave one behind.
void turn_to_worst(const TriMesh& surface, std::vector<Vec3>& normal) {
    constexpr int kTurns = 30;
    constexpr double kSeen = 0.5, kTurn = 0.2;
    std::vector<double> least(normal.size());
    std::vector<Vec3> worst(normal.size());
    for (int i = 0; i < kTurns; ++i) {
        std::fill(least.begin(), least.end(), kSeen);
        for (const Triangle& t : surface.triangles) {
            const Vec3 across = (surface.vertices[t[1]] - surface.vertices[t[0]]).cross(surface.vertices[t[2]] - surface.vertices[t[0]]).normalized();
            for (const Index v : t)
                if (const double seen = across.dot(normal[v]); seen < least[v]) least[v] = seen, worst[v] = across;
        }
        bool turned = false;
        for (std::size_t v = 0; v < normal.size(); ++v)
            if (least[v] < kSeen) normal[v] = (normal[v] + kTurn * worst[v]).normalized(), turned = true;
        if (!turned) return;
    }
}

/// m; from each vertex outwards, so far that its triangles' planes are moved by 1 m: by angles, as no splitting of a face changes.
std::vector<Vec3> find_ways_out(const TriMesh& surface) {
    std::vector<Vec3> normal(surface.vertices.size(), Vec3::Zero());
    std::vector<double> angles(surface.vertices.size(), 0.0), facing(surface.vertices.size(), 0.0);
    const auto for_each_corner = [&](auto&& visit) {
        for (const Triangle& t : surface.triangles) {
            const Vec3 across = (surface.vertices[t[1]] - surface.vertices[t[0]]).cross(surface.vertices[t[2]] - surface.vertices[t[0]]).normalized();
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3 a = surface.vertices[t[(k + 1) % 3]] - surface.vertices[t[k]], b = surface.vertices[t[(k + 2) % 3]] - surface.vertices[t[k]];
                visit(t[k], across, std::atan2(a.cross(b).norm(), a.dot(b)));
            }
        }
    };
    for_each_corner([&](Index v, const Vec3& across, double angle) { normal[v] += angle * across, angles[v] += angle; });
    for (Vec3& n : normal) n.normalize(); // of a vertex without triangles: 0
    turn_to_worst(surface, normal);
    for_each_corner([&](Index v, const Vec3& across, double angle) { facing[v] += angle * across.dot(normal[v]); });
    for (std::size_t v = 0; v < normal.size(); ++v)
        if (facing[v] > 0.0) normal[v] *= std::min(angles[v] / facing[v], kMostLengthening);
    return normal;
}

class WallMaker {
public:
    WallMaker(const TriMesh& surface, const WallOptions& options)
        : surface_(surface), options_(options), way_(find_ways_out(surface)), share_(surface.vertices.size(), 1.0) {}

    /// Thins the wall until no prism folds over. False: too little is left of it somewhere.
    bool fit() {
        constexpr int kMostTries = 60;
        for (int i = 0; i < kMostTries; ++i) {
            const bool folded = thin_folded();
            if (!folded) return true;
            even_out();
            if (!(*std::min_element(share_.begin(), share_.end()) >= kLeastWall)) return false;
        }
        return false;
    }
    [[nodiscard]] Vec3 place(Index vertex, double height) const {
        return surface_.vertices[vertex] + height * share_[vertex] * options_.thickness * way_[vertex];
    }
    [[nodiscard]] const std::vector<double>& shares() const noexcept { return share_; }

private:
    /// Smallest tetrahedron of its prisms, over a third of what a prism of its height there and of the triangle's area has; split as make_layered_mesh does.
    [[nodiscard]] double least_volume(const Triangle& triangle) const {
        Triangle t = triangle;
        std::sort(t.begin(), t.end());
        const Vec3 across = (surface_.vertices[triangle[1]] - surface_.vertices[triangle[0]]).cross(surface_.vertices[triangle[2]] - surface_.vertices[triangle[0]]);
        const Vec3 sorted = (surface_.vertices[t[1]] - surface_.vertices[t[0]]).cross(surface_.vertices[t[2]] - surface_.vertices[t[0]]);
        const double turn = sorted.dot(across) > 0.0 ? 1.0 : -1.0;
        const double height = std::min({share_[t[0]], share_[t[1]], share_[t[2]]}) * options_.thickness / options_.layers;
        const double even = std::sqrt(across.squaredNorm()) * height; // six times the volume of a third
        double least = even;
        for (Index layer = 0; layer < options_.layers; ++layer) {
            const double low = double(layer) / options_.layers, high = double(layer + 1) / options_.layers;
            const Vec3 a = place(t[0], low), b = place(t[1], low), c = place(t[2], low);
            const Vec3 d = place(t[0], high), e = place(t[1], high), f = place(t[2], high);
            const auto six = [turn](const Vec3& o, const Vec3& p, const Vec3& q, const Vec3& r) { return turn * (p - o).cross(q - o).dot(r - o); };
            least = std::min({least, six(a, b, c, f), -six(a, b, e, f), six(a, d, e, f)});
        }
        return least / even;
    }
    bool thin_folded() {
        std::vector<bool> thinner(share_.size(), false);
        for (const Triangle& t : surface_.triangles)
            if (!(least_volume(t) >= kLeastVolume))
                for (const Index v : t) thinner[v] = true;
        bool any = false;
        for (std::size_t v = 0; v < share_.size(); ++v)
            if (thinner[v]) share_[v] *= kThinner, any = true;
        return any;
    }
    void even_out() {
        for (bool changed = true; changed;) {
            changed = false;
            for (const Triangle& t : surface_.triangles)
                for (std::size_t k = 0; k < 3; ++k) {
                    double &a = share_[t[k]], &b = share_[t[(k + 1) % 3]];
                    if (a > kSteepest * b) a = kSteepest * b, changed = true;
                    if (b > kSteepest * a) b = kSteepest * a, changed = true;
                }
        }
    }

    const TriMesh& surface_;
    WallOptions options_;
    std::vector<Vec3> way_;     // [vertex_count] m
    std::vector<double> share_; // [vertex_count] of the thickness
};

} // namespace

Result<WallMesh> make_wall_mesh(const TriMesh& surface, const WallOptions& options) {
    if (!(options.thickness > 0.0) || options.layers == 0)
        return Error{.code = ErrorCode::BadValue,
                     .message = "found a wall of " + std::to_string(options.thickness) + " m in " + std::to_string(options.layers) +
                                " layers, expected a thickness and a layer at least"};
    if (surface.triangles.empty()) return Error{.code = ErrorCode::BadMesh, .message = "the surface has no triangles to lay a wall around"};
    WallMaker maker(surface, options);
    WallMesh wall;
    wall.folds = !maker.fit();
    const std::vector<double>& share = maker.shares();
    wall.thinnest = static_cast<Index>(std::min_element(share.begin(), share.end()) - share.begin());
    wall.least_share = share[wall.thinnest];
    wall.thinned = static_cast<std::size_t>(std::count_if(share.begin(), share.end(), [](double s) { return s < 1.0; }));
    if (!wall.folds) wall.tets = make_layered_mesh(surface, options.layers, [&](Index v, double height) { return maker.place(v, height); });
    return wall;
}

} // namespace trocar::fem
