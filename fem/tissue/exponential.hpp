// Exponential function from additions and multiplications: the same bits on every machine, unlike libm's.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace trocar::fem {

/// Arguments beyond it are taken as it: the result stays a normal number.
inline constexpr double kMostExponent = 690.0;

/// Relative error below 4e-16 |x| / 10 + 4e-16.
[[nodiscard]] inline double natural_exp(double x) noexcept {
    x = x > kMostExponent ? kMostExponent : x < -kMostExponent ? -kMostExponent : x;
    constexpr double kMagic = 6755399441055744.0; // 1.5 * 2^52: adding it rounds to an integer, which stands in the lowest bits
    const double shifted = x * 1.4426950408889634 + kMagic, count = shifted - kMagic;
    const double r = std::fma(count, -1.90821492927058770002e-10, std::fma(count, -0.693147180369123816490, x)); // |r| <= 0.347
    double series = 1.0 / 87178291200.0;                                                                         // 1/14!
    double factorial = 87178291200.0;
    for (int k = 14; k >= 1; --k) {
        factorial /= k;
        series = std::fma(series, r, 1.0 / factorial);
    }
    const std::uint64_t bits = (std::bit_cast<std::uint64_t>(shifted) + 1023) << 52;
    return series * std::bit_cast<double>(bits);
}

} // namespace trocar::fem
