#include "assets/anatomy/polygonise.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace trocar::anatomy {
namespace {

constexpr int kBlock = 8;            // cells along a block's edge
constexpr int kSide = kBlock + 1;    // grid points along it
constexpr double kEdgeMargin = 0.02; // surface vertices keep this far from grid points: no zero-area triangles

/// Corners of a cube by bits x, y, z; the six tetrahedra around its main diagonal 0-7.
constexpr int kKuhn[6][4] = {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}};

struct GridPoint {
    std::int64_t x, y, z;
};

class Polygoniser {
public:
    Polygoniser(const Field& field, const Box3& box, double cell) : field_(field), origin_(box.lo), cell_(cell) {
        for (int axis = 0; axis < 3; ++axis) blocks_[axis] = static_cast<std::int64_t>(std::ceil(box.extent()[axis] / (cell * kBlock)));
    }

    TriMesh run(double steepness) {
        const double reach = 0.5 * std::sqrt(3.0) * kBlock * cell_ * steepness;
        for (std::int64_t z = 0; z < blocks_[2]; ++z)
            for (std::int64_t y = 0; y < blocks_[1]; ++y)
                for (std::int64_t x = 0; x < blocks_[0]; ++x) {
                    const Vec3 middle = position({x * kBlock, y * kBlock, z * kBlock}) + Vec3::Constant(0.5 * kBlock * cell_);
                    if (std::abs(field_.value(middle)) <= reach) cut_block({x * kBlock, y * kBlock, z * kBlock});
                }
        return std::move(mesh_);
    }

private:
    const Field& field_;
    Vec3 origin_;
    double cell_;
    std::int64_t blocks_[3] = {};
    double value_[kSide][kSide][kSide] = {};
    std::unordered_map<std::uint64_t, Index> vertex_on_edge_; // looked up only, never walked: order does not matter
    TriMesh mesh_;

    [[nodiscard]] Vec3 position(const GridPoint& g) const {
        return origin_ + cell_ * Vec3(static_cast<double>(g.x), static_cast<double>(g.y), static_cast<double>(g.z));
    }

    void cut_block(const GridPoint& base) {
        for (int z = 0; z < kSide; ++z)
            for (int y = 0; y < kSide; ++y)
                for (int x = 0; x < kSide; ++x) value_[z][y][x] = field_.value(position({base.x + x, base.y + y, base.z + z}));
        for (int z = 0; z < kBlock; ++z)
            for (int y = 0; y < kBlock; ++y)
                for (int x = 0; x < kBlock; ++x) cut_cell(base, x, y, z);
    }

    void cut_cell(const GridPoint& base, int x, int y, int z) {
        GridPoint corner[8];
        double value[8];
        int inside = 0;
        for (int c = 0; c < 8; ++c) {
            const int cx = x + (c & 1), cy = y + ((c >> 1) & 1), cz = z + (c >> 2);
            corner[c] = {base.x + cx, base.y + cy, base.z + cz};
            value[c] = value_[cz][cy][cx];
            inside += value[c] < 0;
        }
        if (inside == 0 || inside == 8) return;
        for (const auto& tet : kKuhn) cut_tet(corner, value, tet);
    }

    void cut_tet(const GridPoint (&corner)[8], const double (&value)[8], const int (&tet)[4]) {
        int in[4], out[4], in_count = 0, out_count = 0;
        for (const int c : tet) (value[c] < 0 ? in[in_count++] : out[out_count++]) = c;
        const auto cut = [&](int a, int b) { return vertex_between(corner, value, a, b); };
        const Vec3 outwards = position(corner[out_count > 0 ? out[0] : tet[0]]);
        if (in_count == 1) add_triangle({cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2])}, outwards);
        if (in_count == 3) add_triangle({cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0])}, outwards);
        if (in_count == 2) {
            const Index a = cut(in[0], out[0]), b = cut(in[0], out[1]), c = cut(in[1], out[1]), d = cut(in[1], out[0]);
            add_triangle({a, b, c}, position(corner[out[1]]));
            add_triangle({a, c, d}, position(corner[out[0]]));
        }
    }

    Index vertex_between(const GridPoint (&corner)[8], const double (&value)[8], int a, int b) {
        if (a > b) std::swap(a, b); // Kuhn's edges go from a corner to one with more bits
        const GridPoint& g = corner[a];
        const std::uint64_t key =
            ((static_cast<std::uint64_t>(g.x) << 40 | static_cast<std::uint64_t>(g.y) << 20 | static_cast<std::uint64_t>(g.z)) << 3) |
            static_cast<std::uint64_t>(b ^ a);
        const auto [slot, fresh] = vertex_on_edge_.try_emplace(key, static_cast<Index>(mesh_.vertices.size()));
        if (fresh) {
            const double t = std::clamp(value[a] / (value[a] - value[b]), kEdgeMargin, 1 - kEdgeMargin);
            mesh_.vertices.push_back((1 - t) * position(corner[a]) + t * position(corner[b]));
        }
        return slot->second;
    }

    /// outside  a corner of the tetrahedron on the positive side of the triangle
    void add_triangle(Triangle t, const Vec3& outside) {
        const Vec3 &p0 = mesh_.vertices[t[0]], &p1 = mesh_.vertices[t[1]], &p2 = mesh_.vertices[t[2]];
        if ((p1 - p0).cross(p2 - p0).dot(outside - p0) < 0) std::swap(t[1], t[2]);
        mesh_.triangles.push_back(t);
    }
};

} // namespace

TriMesh polygonise(const Field& field, const Box3& box, double cell, double steepness) {
    return Polygoniser(field, box, cell).run(steepness);
}

} // namespace trocar::anatomy
