// Axis-aligned box. Empty boxes have lo > hi and overlap nothing; NaN coordinates never grow a box (comparisons are false).
#pragma once

#include "base/vec.hpp"

namespace trocar {

struct Box3 {
    Vec3 lo = Vec3::Constant(std::numeric_limits<double>::infinity());
    Vec3 hi = Vec3::Constant(-std::numeric_limits<double>::infinity());

    void add(const Vec3& p) noexcept {
        for (int axis = 0; axis < 3; ++axis) {
            if (p[axis] < lo[axis]) lo[axis] = p[axis];
            if (p[axis] > hi[axis]) hi[axis] = p[axis];
        }
    }
    void add(const Box3& other) noexcept {
        lo = lo.cwiseMin(other.lo);
        hi = hi.cwiseMax(other.hi);
    }
    void inflate(double distance) noexcept {
        lo.array() -= distance;
        hi.array() += distance;
    }
    [[nodiscard]] bool empty() const noexcept { return !(lo[0] <= hi[0] && lo[1] <= hi[1] && lo[2] <= hi[2]); }
    [[nodiscard]] bool overlaps(const Box3& other) const noexcept {
        return lo[0] <= other.hi[0] && other.lo[0] <= hi[0] && lo[1] <= other.hi[1] && other.lo[1] <= hi[1] && lo[2] <= other.hi[2] &&
               other.lo[2] <= hi[2];
    }
    [[nodiscard]] bool contains(const Vec3& p) const noexcept {
        return lo[0] <= p[0] && p[0] <= hi[0] && lo[1] <= p[1] && p[1] <= hi[1] && lo[2] <= p[2] && p[2] <= hi[2];
    }
    [[nodiscard]] Vec3 centre() const noexcept { return 0.5 * (lo + hi); }
    [[nodiscard]] Vec3 extent() const noexcept { return hi - lo; }
    [[nodiscard]] double longest_edge() const noexcept { return empty() ? 0.0 : extent().maxCoeff(); }
};

} // namespace trocar
