#include "collision/fine_bounds.hpp"

#include "collision/clones.hpp"

#include <algorithm>

namespace seldinger::collision {
namespace {

constexpr std::size_t kTile = 16;

/// Vertices side by side, coordinate by coordinate.
struct Tile {
    std::array<double, kTile> x, y, z, size; // size: |x| + |y| + |z|
};

/// A short tile repeats its last vertex.
[[gnu::always_inline]] inline void load(std::span<const Vec3> from, std::span<const Index> vertices, Tile& tile) noexcept {
    for (std::size_t i = 0; i < kTile; ++i) {
        const Vec3& p = from[vertices[std::min(i, vertices.size() - 1)]];
        tile.x[i] = p[0];
        tile.y[i] = p[1];
        tile.z[i] = p[2];
    }
    for (std::size_t i = 0; i < kTile; ++i) tile.size[i] = std::abs(tile.x[i]) + std::abs(tile.y[i]) + std::abs(tile.z[i]);
}

using Rows = std::array<std::array<float, kTile>, 2 * kFineSlabs>;

[[gnu::always_inline]] inline void project_tile(const Tile& p0, const Tile& p1, Rows& rows) noexcept {
    std::array<double, kTile> error;
    for (std::size_t i = 0; i < kTile; ++i) error[i] = 0x1p-50 * (p0.size[i] > p1.size[i] ? p0.size[i] : p1.size[i]);
    for (std::size_t s = 0; s < kFineSlabs; ++s) {
        const double nx = kCornerDirections[3 + s][0], ny = kCornerDirections[3 + s][1], nz = kCornerDirections[3 + s][2];
        for (std::size_t i = 0; i < kTile; ++i) {
            const double a = nx * p0.x[i] + ny * p0.y[i] + nz * p0.z[i], b = nx * p1.x[i] + ny * p1.y[i] + nz * p1.z[i];
            rows[s][i] = round_down((a < b ? a : b) - error[i]);
            rows[kFineSlabs + s][i] = round_down((a < b ? -b : -a) - error[i]);
        }
    }
}

/// Lanes that are not finite, or enormous: everywhere.
[[gnu::always_inline]] inline void spread_unfit(const Tile& p0, const Tile& p1, Rows& rows) noexcept {
    bool all_fit = true;
    for (std::size_t i = 0; i < kTile; ++i) all_fit &= p0.size[i] <= kLargestCoordinate && p1.size[i] <= kLargestCoordinate;
    if (all_fit) return;
    for (std::size_t i = 0; i < kTile; ++i)
        if (!(p0.size[i] <= kLargestCoordinate && p1.size[i] <= kLargestCoordinate))
            for (auto& row : rows) row[i] = -SweptBox::kNothing;
}

} // namespace

FineReach fine_reach(double distance) noexcept {
    FineReach reach;
    for (std::size_t s = 0; s < kFineSlabs; ++s) reach[s] = round_up(distance * direction_length(kCornerDirections[3 + s]));
    return reach;
}

SELDINGER_CLONES
FineBounds project_finely(std::span<const Vec3> t0, std::span<const Vec3> t1, std::span<const Index> vertices, std::span<FineBounds> out) noexcept {
    FineBounds all;
    all.clear();
    for (std::size_t first = 0; first < vertices.size(); first += kTile) {
        const auto ids = vertices.subspan(first, std::min(kTile, vertices.size() - first));
        Tile p0, p1;
        load(t0, ids, p0);
        load(t1, ids, p1);
        Rows rows;
        project_tile(p0, p1, rows);
        spread_unfit(p0, p1, rows);
        for (std::size_t s = 0; s < rows.size(); ++s)
            for (std::size_t i = 0; i < kTile; ++i) all.row[s] = rows[s][i] < all.row[s] ? rows[s][i] : all.row[s];
        for (std::size_t i = 0; i < ids.size(); ++i)
            for (std::size_t s = 0; s < rows.size(); ++s) out[ids[i]].row[s] = rows[s][i];
    }
    return all;
}

} // namespace seldinger::collision
