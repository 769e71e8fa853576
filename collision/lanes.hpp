// Four doubles in the compiler's vector type: two SSE2 registers where nothing better is there, one AVX2
// register where the machine has it. Every lane does what a scalar would do, in the same order, so the bits are the same.
#pragma once

#include "base/vec.hpp"

#include <cmath>
#include <cstring>

namespace trocar::collision {

inline constexpr int kLanes = 4;

using Lanes = double __attribute__((vector_size(8 * kLanes)));
using Mask = long long __attribute__((vector_size(8 * kLanes))); // -1: yes, 0: no

#define TROCAR_LANES_INLINE [[gnu::always_inline]] inline // cloned kernels must not call functions compiled for another instruction set

TROCAR_LANES_INLINE Lanes all(double value) noexcept { return Lanes{value, value, value, value}; }
TROCAR_LANES_INLINE bool any(Mask mask) noexcept { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }
TROCAR_LANES_INLINE Lanes smaller(Lanes a, Lanes b) noexcept { return b < a ? b : a; }
TROCAR_LANES_INLINE Lanes larger(Lanes a, Lanes b) noexcept { return a < b ? b : a; }
TROCAR_LANES_INLINE Lanes magnitude(Lanes a) noexcept { return a < 0.0 ? -a : a; }
TROCAR_LANES_INLINE Lanes square_root(Lanes a) noexcept {
    return Lanes{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}

struct Lanes3 {
    Lanes x, y, z;

    [[nodiscard]] Vec3 get(int lane) const noexcept { return {x[lane], y[lane], z[lane]}; }
};

/// Four points side by side: x and y come together, which halves the shuffles of setting lane by lane.
TROCAR_LANES_INLINE Lanes3 gather_points(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) noexcept {
    using Two = double __attribute__((vector_size(16)));
    const auto load = [](const double* from) __attribute__((always_inline)) {
        Two two;
        std::memcpy(&two, from, sizeof two);
        return two;
    };
    const auto join = [](Two low, Two high) __attribute__((always_inline)) { return __builtin_shufflevector(low, high, 0, 1, 2, 3); };
    const Lanes xy_ac = join(load(a.data()), load(c.data())), xy_bd = join(load(b.data()), load(d.data()));
    return {__builtin_shufflevector(xy_ac, xy_bd, 0, 4, 2, 6), __builtin_shufflevector(xy_ac, xy_bd, 1, 5, 3, 7),
            Lanes{a[2], b[2], c[2], d[2]}};
}

TROCAR_LANES_INLINE Lanes3 operator+(const Lanes3& a, const Lanes3& b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
TROCAR_LANES_INLINE Lanes3 operator-(const Lanes3& a, const Lanes3& b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
TROCAR_LANES_INLINE Lanes3 operator*(Lanes s, const Lanes3& a) noexcept { return {s * a.x, s * a.y, s * a.z}; }
TROCAR_LANES_INLINE Lanes dot(const Lanes3& a, const Lanes3& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
TROCAR_LANES_INLINE Lanes3 cross(const Lanes3& a, const Lanes3& b) noexcept {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
TROCAR_LANES_INLINE Lanes3 select(Mask mask, const Lanes3& yes, const Lanes3& no) noexcept {
    return {mask ? yes.x : no.x, mask ? yes.y : no.y, mask ? yes.z : no.z};
}

} // namespace trocar::collision
