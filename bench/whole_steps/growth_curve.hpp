// A figure over the number of elements, and the power of that number with which it grows.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

namespace trocar::engine {

struct GrowthPoint {
    std::size_t elements = 0;
    double step_ms = 0.0; // median
    double bytes = 0.0;   // held by model, state and scratch
};

/// Slope of a straight line through log(step_ms) over log(elements), by least squares. Nothing for fewer than two sizes.
[[nodiscard]] inline std::optional<double> fit_exponent(std::span<const GrowthPoint> points) noexcept {
    double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    for (const GrowthPoint& point : points) {
        if (point.elements == 0 || !(point.step_ms > 0.0)) continue;
        const double lx = std::log(static_cast<double>(point.elements)), ly = std::log(point.step_ms);
        n += 1.0, x += lx, y += ly, xx += lx * lx, xy += lx * ly;
    }
    const double spread = n * xx - x * x;
    return spread > 1e-9 * n * xx ? std::optional((n * xy - x * y) / spread) : std::nullopt;
}

/// Bytes that one more element takes, between the smallest and the largest size; what every size has alike is not in it.
[[nodiscard]] inline std::optional<double> bytes_per_element(std::span<const GrowthPoint> points) noexcept {
    if (points.size() < 2 || points.back().elements <= points.front().elements) return std::nullopt;
    return (points.back().bytes - points.front().bytes) / static_cast<double>(points.back().elements - points.front().elements);
}

} // namespace trocar::engine
