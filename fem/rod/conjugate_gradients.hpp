// Conjugate gradients whose preconditioner is the rod's own factorised band: what couples places of the rod that are no neighbours along
// it (Hestenes & Stiefel 1952). The matrix is band + coupling, the band's product is never formed: of a direction p = z + beta p' it is
// r + beta M p', since M z = r. One substitution an iteration, O(n).
#pragma once

#include "fem/rod/rod_model.hpp"

#include <algorithm>
#include <span>

namespace trocar::fem {

/// [-] of the right side, in the norm that the preconditioner gives: Newton's next iteration corrects what is left.
inline constexpr double kInnerTolerance = 3e-2;
inline constexpr unsigned kMostInner = 200;

/// m; of a place between a node and the next, where `p` is a motion of the coordinates of all nodes from `first` on.
template <std::size_t kCoordinates>
[[nodiscard]] Vec3 motion_at(std::span<const double> p, Index first, Index node, double weight) noexcept {
    Vec3 sum = Vec3::Zero();
    for (Index a = 0; a < 2; ++a) {
        if (node + a < first) continue;
        const double* at = p.data() + kCoordinates * (node + a - first);
        sum += (a == 0 ? 1.0 - weight : weight) * Vec3(at[0], at[1], at[2]);
    }
    return sum;
}

/// The force that either place feels as the other one moves by p, taken off `out`.
template <std::size_t kCoordinates>
void couple_places(std::span<const RodCoupling> couplings, Index first, std::span<const double> p, std::span<double> out) noexcept {
    const auto take = [&](Index node, double weight, const Vec3& force) {
        for (Index a = 0; a < 2; ++a) {
            if (node + a < first) continue;
            double* at = out.data() + kCoordinates * (node + a - first);
            for (int axis = 0; axis < 3; ++axis) at[axis] -= (a == 0 ? 1.0 - weight : weight) * force[axis];
        }
    };
    for (const RodCoupling& pair : couplings) {
        take(pair.node, pair.weight, pair.stiffness * motion_at<kCoordinates>(p, first, pair.other, pair.other_weight));
        take(pair.other, pair.other_weight, pair.stiffness * motion_at<kCoordinates>(p, first, pair.node, pair.weight));
    }
}

/// Solves (band + coupling) x = b from x = 0. Every iterate makes the error least in the matrix's own norm: whatever ends it, x . b is
/// x . (band + coupling) x.
/// band      factorised; x holds its own solution before, this one's after
/// couple    (p, out): adds coupling p to out
/// Returns how many iterations it took.
template <class Band, class Couple>
unsigned conjugate_gradients(Band& band, std::span<const double> b, std::span<double> x, RodWorkspace& work, Couple&& couple) noexcept {
    const std::size_t size = b.size();
    const auto part = [&](std::vector<double>& list) { return std::span(list).first(size); };
    const auto r = part(work.remainder), z = part(work.guess), p = part(work.direction), m = part(work.banded), y = part(work.solution);
    const auto dot = [&](std::span<const double> u, std::span<const double> v) {
        double sum[8] = {}; // what one sum waits for, eight do not
        std::size_t k = 0;
        for (; k + 8 <= size; k += 8)
            for (std::size_t lane = 0; lane < 8; ++lane) sum[lane] += u[k + lane] * v[k + lane];
        for (; k < size; ++k) sum[0] += u[k] * v[k];
        return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
    };
    std::copy(b.begin(), b.end(), r.begin());
    std::copy(x.begin(), x.end(), p.begin());
    std::copy(b.begin(), b.end(), m.begin());
    std::fill(y.begin(), y.end(), 0.0);
    double left = dot(r, p);
    const double enough = kInnerTolerance * kInnerTolerance * left;
    unsigned iteration = 0;
    while (left > 0.0 && iteration < kMostInner) {
        ++iteration;
        std::copy(m.begin(), m.end(), z.begin());
        couple(std::span<const double>(p), z);
        const double bends = dot(p, z);
        if (!(bends > 0.0)) break; // rounding, or not finite: what was found so far stands
        const double along = left / bends;
        for (std::size_t k = 0; k < size; ++k) y[k] += along * p[k], r[k] -= along * z[k];
        std::copy(r.begin(), r.end(), z.begin());
        band.solve_again(z, 0);
        const double now = dot(r, z);
        if (!(now > enough)) break;
        const double back = now / left;
        for (std::size_t k = 0; k < size; ++k) p[k] = z[k] + back * p[k], m[k] = r[k] + back * m[k];
        left = now;
    }
    std::copy(y.begin(), y.end(), x.begin());
    return iteration;
}

} // namespace trocar::fem
