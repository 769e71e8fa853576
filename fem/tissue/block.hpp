// 3x3 matrices as plain arrays: Eigen's are slower at this size.
#pragma once

namespace trocar::fem {

/// 3x3, row-major.
template <class T>
struct Block {
    T m[9];
};

/// a b
template <class T>
[[nodiscard]] inline Block<T> product(const Block<T>& a, const Block<T>& b) noexcept {
    Block<T> c;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) c.m[3 * i + j] = a.m[3 * i] * b.m[j] + a.m[3 * i + 1] * b.m[3 + j] + a.m[3 * i + 2] * b.m[6 + j];
    return c;
}

/// a^T b
template <class T>
[[nodiscard]] inline Block<T> transposed_product(const Block<T>& a, const Block<T>& b) noexcept {
    Block<T> c;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) c.m[3 * i + j] = a.m[i] * b.m[j] + a.m[3 + i] * b.m[3 + j] + a.m[6 + i] * b.m[6 + j];
    return c;
}

/// sum_ij a_ij b_ij
template <class T>
[[nodiscard]] inline T contraction(const Block<T>& a, const Block<T>& b) noexcept {
    T sum = a.m[0] * b.m[0];
    for (int i = 1; i < 9; ++i) sum += a.m[i] * b.m[i];
    return sum;
}

/// d det(a) / d a, the cofactors.
template <class T>
[[nodiscard]] inline Block<T> cofactors(const Block<T>& a) noexcept {
    const T* f = a.m;
    return {{f[4] * f[8] - f[5] * f[7], f[5] * f[6] - f[3] * f[8], f[3] * f[7] - f[4] * f[6], f[2] * f[7] - f[1] * f[8],
             f[0] * f[8] - f[2] * f[6], f[1] * f[6] - f[0] * f[7], f[1] * f[5] - f[2] * f[4], f[2] * f[3] - f[0] * f[5],
             f[0] * f[4] - f[1] * f[3]}};
}

template <class T>
[[nodiscard]] inline T determinant(const Block<T>& f) noexcept {
    return f.m[0] * (f.m[4] * f.m[8] - f.m[5] * f.m[7]) + f.m[1] * (f.m[5] * f.m[6] - f.m[3] * f.m[8]) +
           f.m[2] * (f.m[3] * f.m[7] - f.m[4] * f.m[6]);
}

} // namespace trocar::fem
