// Axis-aligned box of a moving feature in single precision, rounded outwards: half the memory of doubles, and a comparison is five
// instructions. The upper corner is stored negated, so that joining boxes is one minimum, and one sum is a gap.
#pragma once

#include "base/vec.hpp"

#include <cmath>
#include <cstring>

namespace trocar::collision {

using Float4 = float __attribute__((vector_size(16)));

struct SweptBox {
    static constexpr float kNothing = std::numeric_limits<float>::infinity();

    Float4 lo = {kNothing, kNothing, kNothing, 0.0f};       // m, the last one is padding
    Float4 minus_hi = {kNothing, kNothing, kNothing, 0.0f}; // m

    void add(const SweptBox& other) noexcept {
        lo = other.lo < lo ? other.lo : lo;
        minus_hi = other.minus_hi < minus_hi ? other.minus_hi : minus_hi;
    }
};

/// Beyond this a coordinate is treated like NaN: as being everywhere. Far below the largest float, so sums stay finite.
inline constexpr double kLargestCoordinate = 1e37; // m
/// No coordinate is beyond it; false for NaN.
[[nodiscard]] inline bool is_bounded(const Vec3& p) noexcept { return (p.array().abs() <= kLargestCoordinate).all(); }

/// A float that is not above x. With y = x - 2^-23 |x| - 2^-148, rounding adds at most 2^-24 |y| + 2^-150, less than was taken off.
[[nodiscard]] inline float round_down(double x) noexcept { return static_cast<float>(x - 0x1p-23 * std::abs(x) - 0x1p-148); }
/// A float that is not below x, for 0 <= x; infinity stays.
[[nodiscard]] inline float round_up(double x) noexcept { return -round_down(-x); }

/// Holds the vertex at every time of the step. Non-finite or enormous coordinates give the box that overlaps everything.
[[nodiscard]] inline SweptBox make_swept_box(const Vec3& t0, const Vec3& t1) noexcept {
    SweptBox box;
    box.lo[3] = box.minus_hi[3] = 0.0f;
    bool fits = true;
    for (int axis = 0; axis < 3; ++axis) {
        fits = fits && std::abs(t0[axis]) <= kLargestCoordinate && std::abs(t1[axis]) <= kLargestCoordinate;
        box.lo[axis] = round_down(t0[axis] < t1[axis] ? t0[axis] : t1[axis]);
        box.minus_hi[axis] = round_down(t0[axis] < t1[axis] ? -t1[axis] : -t0[axis]);
    }
    if (fits) return box;
    const Float4 everywhere = {-SweptBox::kNothing, -SweptBox::kNothing, -SweptBox::kNothing, 0.0f};
    return {everywhere, everywhere};
}

/// False only if the boxes are farther apart than the distance. Rounding is monotone: where a true gap is at most the distance,
/// so is the rounded one, and no box needs inflating.
/// distance   m, >= 0, rounded up
[[nodiscard]] inline bool are_near(const SweptBox& a, const SweptBox& b, float distance) noexcept {
    const Float4 ab = a.lo + b.minus_hi, ba = b.lo + a.minus_hi;
    const auto apart = (ab < ba ? ba : ab) > distance;
    std::uint64_t halves[2];
    std::memcpy(halves, &apart, sizeof halves);
    return (halves[0] | halves[1]) == 0;
}

} // namespace trocar::collision
