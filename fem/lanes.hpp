// Two doubles at once in plain SSE2 or NEON (a compiler vector type): the force loop handles tets in pairs. Each lane does
// exactly what the scalar code does, so that a pair and two single tets give the same bits.
#pragma once

namespace seldinger::fem {

using Pair = double __attribute__((vector_size(16)));

template <class T> struct LaneTraits;
template <> struct LaneTraits<double> {
    static constexpr int kCount = 1;
    template <class Value> static double make(Value&& value) noexcept { return value(0); }
};
template <> struct LaneTraits<Pair> {
    static constexpr int kCount = 2;
    template <class Value> static Pair make(Value&& value) noexcept { return Pair{value(0), value(1)}; }
};

/// Lane l holds value(l).
template <class T, class Value> [[nodiscard]] inline T make_lanes(Value&& value) noexcept {
    return LaneTraits<T>::make(value);
}

inline double get_lane(double value, int) noexcept { return value; }
inline double get_lane(Pair value, int lane) noexcept { return value[lane]; }

/// 3x3, row-major.
template <class T> struct Block { T m[9]; };

/// a b
template <class T> [[nodiscard]] inline Block<T> product(const Block<T>& a, const Block<T>& b) noexcept {
    Block<T> c;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            c.m[3 * i + j] = a.m[3 * i] * b.m[j] + a.m[3 * i + 1] * b.m[3 + j] + a.m[3 * i + 2] * b.m[6 + j];
    return c;
}

/// a^T b
template <class T> [[nodiscard]] inline Block<T> transposed_product(const Block<T>& a, const Block<T>& b) noexcept {
    Block<T> c;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            c.m[3 * i + j] = a.m[i] * b.m[j] + a.m[3 + i] * b.m[3 + j] + a.m[6 + i] * b.m[6 + j];
    return c;
}

/// a b^T
template <class T> [[nodiscard]] inline Block<T> product_transposed(const Block<T>& a, const Block<T>& b) noexcept {
    Block<T> c;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            c.m[3 * i + j] = a.m[3 * i] * b.m[3 * j] + a.m[3 * i + 1] * b.m[3 * j + 1] + a.m[3 * i + 2] * b.m[3 * j + 2];
    return c;
}

/// sum_ij a_ij b_ij
template <class T> [[nodiscard]] inline T contraction(const Block<T>& a, const Block<T>& b) noexcept {
    T sum = a.m[0] * b.m[0];
    for (int i = 1; i < 9; ++i) sum += a.m[i] * b.m[i];
    return sum;
}

/// d det(a) / d a, the cofactors.
template <class T> [[nodiscard]] inline Block<T> cofactors(const Block<T>& a) noexcept {
    const T* f = a.m;
    return {{f[4] * f[8] - f[5] * f[7], f[5] * f[6] - f[3] * f[8], f[3] * f[7] - f[4] * f[6],
             f[2] * f[7] - f[1] * f[8], f[0] * f[8] - f[2] * f[6], f[1] * f[6] - f[0] * f[7],
             f[1] * f[5] - f[2] * f[4], f[2] * f[3] - f[0] * f[5], f[0] * f[4] - f[1] * f[3]}};
}

/// Directional derivative of cofactors(a) along b.
template <class T>
[[nodiscard]] inline Block<T> cofactors_along(const Block<T>& a, const Block<T>& b) noexcept {
    Block<T> c;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const int r = (i + 1) % 3 * 3, s = (i + 2) % 3 * 3, p = (j + 1) % 3, q = (j + 2) % 3;
            c.m[3 * i + j] = a.m[r + p] * b.m[s + q] + b.m[r + p] * a.m[s + q] - a.m[r + q] * b.m[s + p] -
                             b.m[r + q] * a.m[s + p];
        }
    return c;
}

} // namespace seldinger::fem
