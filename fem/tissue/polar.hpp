// Rotation of the polar decomposition with nothing beyond sqrt, proper (det R = +1) also for inverted matrices.
// This work is based on: Horn 1987 (the rotation that maximises tr(R^T F) is the dominant eigenvector of a 4x4 matrix),
// Theobald 2005 (that eigenvalue by Newton's method on the quartic, from an upper bound).
#pragma once

#include "fem/tissue/block.hpp"

#include <cmath>

namespace trocar::fem {

namespace detail {

/// Largest root of x^4 + c2 x^2 + c1 x + c0 by Newton from above: monotone, since the quartic is convex there.
[[nodiscard]] inline double largest_root(double c2, double c1, double c0, double upper) noexcept {
    double x = upper;
    for (int round = 0; round < 40; ++round) {
        const double value = ((x * x + c2) * x + c1) * x + c0;
        const double slope = (4.0 * x * x + 2.0 * c2) * x + c1;
        if (!(slope > 0.0)) break;
        const double next = x - value / slope;
        if (!(next < x)) break;
        const bool settled = x - next <= 1e-15 * x;
        x = next;
        if (settled) break;
    }
    return x;
}

[[nodiscard]] inline double minor3(const double a[4][4], int row, int column) noexcept {
    int r[3], c[3];
    for (int i = 0, k = 0; i < 4; ++i)
        if (i != row) r[k++] = i;
    for (int j = 0, k = 0; j < 4; ++j)
        if (j != column) c[k++] = j;
    return a[r[0]][c[0]] * (a[r[1]][c[1]] * a[r[2]][c[2]] - a[r[1]][c[2]] * a[r[2]][c[1]]) -
           a[r[0]][c[1]] * (a[r[1]][c[0]] * a[r[2]][c[2]] - a[r[1]][c[2]] * a[r[2]][c[0]]) +
           a[r[0]][c[2]] * (a[r[1]][c[0]] * a[r[2]][c[1]] - a[r[1]][c[1]] * a[r[2]][c[0]]);
}

[[nodiscard]] inline Block<double> quaternion_to_rotation(double w, double x, double y, double z) noexcept {
    return {{w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y), 2.0 * (x * y + w * z),
             w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x), 2.0 * (x * z - w * y), 2.0 * (y * z + w * x),
             w * w - x * x - y * y + z * z}};
}

} // namespace detail

/// The rotation nearest to f. Zero, rank-one and exactly mirrored matrices have no single answer: identity or one of the
/// nearest is returned, always finite for finite f.
[[nodiscard]] inline Block<double> nearest_rotation(const Block<double>& block) noexcept {
    constexpr Block<double> kIdentity{{1, 0, 0, 0, 1, 0, 0, 0, 1}};
    double scale = 0.0;
    for (const double entry : block.m) scale = std::abs(entry) > scale ? std::abs(entry) : scale;
    if (!(scale > 1e-150 && scale < 1e150)) return kIdentity;
    Block<double> f;
    for (int i = 0; i < 9; ++i) f.m[i] = block.m[i] / scale;
    const Block<double> cof = cofactors(f);
    const double size_sq = contraction(f, f);
    const double det = f.m[0] * cof.m[0] + f.m[1] * cof.m[1] + f.m[2] * cof.m[2];
    const double root =
        detail::largest_root(-2.0 * size_sq, -8.0 * det, size_sq * size_sq - 4.0 * contraction(cof, cof), std::sqrt(3.0 * size_sq));
    const double* m = f.m;
    const double a[4][4] = {{m[0] + m[4] + m[8] - root, m[7] - m[5], m[2] - m[6], m[3] - m[1]},
                            {m[7] - m[5], m[0] - m[4] - m[8] - root, m[1] + m[3], m[2] + m[6]},
                            {m[2] - m[6], m[1] + m[3], m[4] - m[0] - m[8] - root, m[5] + m[7]},
                            {m[3] - m[1], m[2] + m[6], m[5] + m[7], m[8] - m[0] - m[4] - root}};
    // Every row of the adjugate of a singular symmetric matrix is its null vector; the longest row is the accurate one.
    int best = 0;
    double best_size = -1.0;
    for (int i = 0; i < 4; ++i) {
        const double size = std::abs(detail::minor3(a, i, i));
        if (size > best_size) {
            best_size = size;
            best = i;
        }
    }
    double q[4], length_sq = 0.0;
    for (int j = 0; j < 4; ++j) {
        q[j] = ((best + j) % 2 ? -1.0 : 1.0) * detail::minor3(a, best, j);
        length_sq += q[j] * q[j];
    }
    if (!(length_sq > 1e-60)) return kIdentity;
    const double factor = 1.0 / std::sqrt(length_sq);
    return detail::quaternion_to_rotation(q[0] * factor, q[1] * factor, q[2] * factor, q[3] * factor);
}

} // namespace trocar::fem
