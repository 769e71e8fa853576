// Random rods, and how near a chain comes to itself, by means that the engine does not use.
#pragma once

#include "base/vec.hpp"

#include <algorithm>
#include <random>
#include <vector>

namespace trocar::fem {

class Dice {
public:
    explicit Dice(unsigned seed) : random_(seed) {}
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    Vec3 direction() {
        for (;;) {
            const Vec3 v(between(-1, 1), between(-1, 1), between(-1, 1));
            const double length = v.norm();
            if (length > 0.1 && length < 1.0) return v / length;
        }
    }
    Vec3 point(double size) { return {between(-size, size), between(-size, size), between(-size, size)}; }

private:
    std::mt19937 random_;
};

/// m, between two segments; shares nothing with the engine: the least over s, by ternary search, of the way from a point to the other one.
inline double distance_by_search(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto to_other = [&](double s) {
        const Vec3 p = a + s * (b - a);
        const double length_sq = (d - c).squaredNorm();
        const double t = length_sq > 0.0 ? std::clamp((p - c).dot(d - c) / length_sq, 0.0, 1.0) : 0.0;
        return (p - c - t * (d - c)).norm();
    };
    double low = 0.0, high = 1.0; // the way to a convex set is convex along a line
    for (int round = 0; round < 60; ++round) {
        const double one = low + (high - low) / 3.0, two = high - (high - low) / 3.0;
        if (to_other(one) < to_other(two))
            high = two;
        else
            low = one;
    }
    return to_other(0.5 * (low + high));
}

/// m; of all pairs that are as far apart along the rod as `gap` segments.
inline double nearest_by_search(const std::vector<Vec3>& axis, std::size_t gap) {
    double nearest = 1.0;
    for (std::size_t i = 0; i + 1 < axis.size(); ++i)
        for (std::size_t j = i + gap; j + 1 < axis.size(); ++j) {
            const double apart = (0.5 * (axis[i] + axis[i + 1]) - 0.5 * (axis[j] + axis[j + 1])).norm();
            const double halves = 0.5 * ((axis[i + 1] - axis[i]).norm() + (axis[j + 1] - axis[j]).norm());
            if (apart - halves < nearest) nearest = std::min(nearest, distance_by_search(axis[i], axis[i + 1], axis[j], axis[j + 1]));
        }
    return nearest;
}

/// m, from a place to the cubic through the nodes, sampled: shares nothing with find_on_curve.
inline double distance_to_curve(const std::vector<Vec3>& x, const Vec3& place) {
    double least = 1.0;
    for (std::size_t i = 0; i + 1 < x.size(); ++i) {
        if ((x[i] - place).norm() > 3.0 * (x[i + 1] - x[i]).norm()) continue;
        const Vec3 before = i > 0 ? x[i - 1] : Vec3(2.0 * x[0] - x[1]), after = i + 2 < x.size() ? x[i + 2] : Vec3(2.0 * x[i + 1] - x[i]);
        for (int k = 0; k <= 200; ++k) {
            const double t = k / 200.0;
            const Vec3 on = 0.5 * (2.0 * x[i] + (x[i + 1] - before) * t + (2.0 * before - 5.0 * x[i] + 4.0 * x[i + 1] - after) * t * t +
                                   (3.0 * x[i] - before - 3.0 * x[i + 1] + after) * t * t * t);
            least = std::min(least, (on - place).norm());
        }
    }
    return least;
}

} // namespace trocar::fem
