// Natural logarithm from additions, multiplications and one division: the same bits on every machine, unlike libm's.
#pragma once

#include <bit>
#include <cstdint>

namespace trocar::fem {

/// x > 0, normal and finite; relative error below 4e-16, also near 1. Anything else is returned as a quiet NaN.
[[nodiscard]] inline double natural_log(double x) noexcept {
    constexpr std::uint64_t kMantissa = 0x000fffffffffffffULL, kOne = 0x3ff0000000000000ULL;
    const std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
    if (bits < 0x0010000000000000ULL || bits >= 0x7ff0000000000000ULL) return std::bit_cast<double>(0x7ff8000000000000ULL);
    int exponent = static_cast<int>(bits >> 52) - 1023;
    double m = std::bit_cast<double>((bits & kMantissa) | kOne);
    if (m > 1.4142135623730951) {
        m *= 0.5;
        ++exponent;
    }
    // log m = 2 atanh(s); |s| <= 0.1716, so that the last term kept is below 1e-17 of the first
    const double s = (m - 1.0) / (m + 1.0);
    const double z = s * s;
    double series = 0.0;
    for (int k = 21; k >= 3; k -= 2) series = (series + 1.0 / k) * z;
    constexpr double kLn2High = 0.693147180369123816490, kLn2Low = 1.90821492927058770002e-10;
    return exponent * kLn2High + (2.0 * s + (2.0 * s * series + exponent * kLn2Low));
}

} // namespace trocar::fem
