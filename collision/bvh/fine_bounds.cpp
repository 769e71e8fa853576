#include "collision/bvh/fine_bounds.hpp"

#include "collision/clones.hpp"
#include "collision/lanes.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

using FloatLanes = float __attribute__((vector_size(4 * kLanes)));

/// Four vertices at one time: their projections in the order of kCornerDirections, and |x| + |y| + |z|.
struct Projections {
    std::array<Lanes, kFineSlabs> at;
    Lanes size;
};

/// A short span repeats its last vertex. The sums are those of project_vertex, so its bound on their error, 2^-50 of
/// the size, holds.
TROCAR_LANES_INLINE Projections project(std::span<const Vec3> from, std::span<const Index> vertices) noexcept {
    const std::size_t last = vertices.size() - 1;
    const Lanes3 p = gather_points(from[vertices[0]], from[vertices[std::min<std::size_t>(1, last)]],
                                   from[vertices[std::min<std::size_t>(2, last)]], from[vertices[std::min<std::size_t>(3, last)]]);
    const Lanes sum = p.x + p.y, difference = p.x - p.y;
    return {{sum + p.z, sum - p.z, difference + p.z, difference - p.z, sum, p.x + p.z, p.y + p.z, difference, p.x - p.z, p.y - p.z},
            magnitude(p.x) + magnitude(p.y) + magnitude(p.z)};
}

/// round_down, lane by lane.
TROCAR_LANES_INLINE FloatLanes round_down(Lanes x) noexcept {
    return __builtin_convertvector(x - 0x1p-23 * magnitude(x) - 0x1p-148, FloatLanes);
}

TROCAR_LANES_INLINE bool all_fit(Lanes size) noexcept {
    return !any(~(size <= kLargestCoordinate)); // NaN does not
}

TROCAR_LANES_INLINE double smallest(Lanes x) noexcept {
    double least = x[0];
    for (int lane = 1; lane < kLanes; ++lane) least = x[lane] < least ? x[lane] : least;
    return least;
}

} // namespace

FineReach fine_reach(double distance) noexcept {
    FineReach reach;
    for (std::size_t s = 0; s < kFineSlabs; ++s) reach[s] = round_up(distance * direction_length(kCornerDirections[3 + s]));
    return reach;
}

TROCAR_CLONES
FineBounds join_finely(std::span<const Vec3> t0, std::span<const Vec3> t1, std::span<const Index> vertices) noexcept {
    std::array<Lanes, kFineSlabs> lo, hi;
    lo.fill(all(std::numeric_limits<double>::infinity()));
    hi.fill(all(-std::numeric_limits<double>::infinity()));
    Lanes size = all(0.0);
    bool fit = true;
    for (std::size_t first = 0; first < vertices.size(); first += kLanes) {
        const Projections p0 = project(t0, vertices.subspan(first)), p1 = project(t1, vertices.subspan(first));
        for (std::size_t s = 0; s < kFineSlabs; ++s) {
            lo[s] = smaller(lo[s], smaller(p0.at[s], p1.at[s]));
            hi[s] = larger(hi[s], larger(p0.at[s], p1.at[s]));
        }
        fit = fit && all_fit(p0.size) && all_fit(p1.size);
        size = larger(size, larger(p0.size, p1.size));
    }
    FineBounds bounds;
    if (!fit) {
        bounds.row.fill(-SweptBox::kNothing);
        return bounds;
    }
    const double error = 0x1p-50 * -smallest(-size);
    for (std::size_t s = 0; s < kFineSlabs; ++s) {
        bounds.row[s] = collision::round_down(smallest(lo[s]) - error);
        bounds.row[kFineSlabs + s] = collision::round_down(smallest(-hi[s]) - error);
    }
    return bounds;
}

TROCAR_CLONES
void project_finely(std::span<const Vec3> t0, std::span<const Vec3> t1, std::span<const Index> vertices,
                    std::span<FineBounds> out) noexcept {
    for (std::size_t first = 0; first < vertices.size(); first += kLanes) {
        const auto ids = vertices.subspan(first, std::min<std::size_t>(kLanes, vertices.size() - first));
        const Projections p0 = project(t0, ids), p1 = project(t1, ids);
        const Lanes size = larger(p0.size, p1.size), error = 0x1p-50 * size;
        std::array<FloatLanes, 2 * kFineSlabs> rows;
        for (std::size_t s = 0; s < kFineSlabs; ++s) {
            rows[s] = round_down(smaller(p0.at[s], p1.at[s]) - error);
            rows[kFineSlabs + s] = round_down(-larger(p0.at[s], p1.at[s]) - error);
        }
        for (std::size_t i = 0; i < ids.size(); ++i)
            for (std::size_t s = 0; s < rows.size(); ++s) out[ids[i]].row[s] = rows[s][static_cast<int>(i)];
        if (all_fit(p0.size) && all_fit(p1.size)) continue;
        for (std::size_t i = 0; i < ids.size(); ++i)
            if (const int lane = static_cast<int>(i); !(p0.size[lane] <= kLargestCoordinate && p1.size[lane] <= kLargestCoordinate))
                out[ids[i]].row.fill(-SweptBox::kNothing);
    }
}

} // namespace trocar::collision
