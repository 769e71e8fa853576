#include "base/trig.hpp"

#include <cmath>

namespace trocar {
namespace {

// pi/2 as a sum; the first two have 33 bits, so that their products with a count below 2^20 are exact
constexpr double kHalfPi1 = 0x1.921fb544p+0;
constexpr double kHalfPi2 = 0x1.0b4611a6p-34;
constexpr double kHalfPi3 = 0x1.3198a2e037073p-69;
constexpr double kTwoOverPi = 0.63661977236758134308;
constexpr double kFurthest = 1e9; // rad: beyond it the reduced angle has lost half its digits

/// An angle in about [-pi/4, pi/4] and what rounding cut off it.
struct Reduced {
    double head, tail;
};

/// sin(head + tail). Taylor to degree 17: the next term is below 2e-19 of the sum.
double sine(const Reduced& r) noexcept {
    const double z = r.head * r.head;
    double sum = 1.0 / 355687428096000.0;
    sum = sum * z - 1.0 / 1307674368000.0;
    sum = sum * z + 1.0 / 6227020800.0;
    sum = sum * z - 1.0 / 39916800.0;
    sum = sum * z + 1.0 / 362880.0;
    sum = sum * z - 1.0 / 5040.0;
    sum = sum * z + 1.0 / 120.0;
    const double cube = z * r.head;
    // sin(h + t) = sin h + t cos h; cos h is 1 - z / 2 to the accuracy the tail needs
    return r.head + (cube * (sum * z - 1.0 / 6.0) + r.tail * (1.0 - 0.5 * z));
}

/// cos(head + tail). 1 - z / 2 is rounded once, what that loses is given back with the small terms.
double cosine(const Reduced& r) noexcept {
    const double z = r.head * r.head;
    double sum = -1.0 / 6402373705728000.0;
    sum = sum * z + 1.0 / 20922789888000.0;
    sum = sum * z - 1.0 / 87178291200.0;
    sum = sum * z + 1.0 / 479001600.0;
    sum = sum * z - 1.0 / 3628800.0;
    sum = sum * z + 1.0 / 40320.0;
    sum = sum * z - 1.0 / 720.0;
    sum = sum * z + 1.0 / 24.0;
    const double half = 0.5 * z, main = 1.0 - half;
    return main + (((1.0 - main) - half) + (z * z * sum - r.head * r.tail));
}

} // namespace

SinCos sin_cos(double x) noexcept {
    if (!(std::abs(x) <= kFurthest)) return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
    const auto quarter_turns = static_cast<long long>(x * kTwoOverPi + (x < 0.0 ? -0.5 : 0.5));
    const auto n = static_cast<double>(quarter_turns);
    const double first = x - n * kHalfPi1;
    const double second = n * kHalfPi2;
    const double partial = first - second;
    const double third = n * kHalfPi3 - ((first - partial) - second);
    Reduced r;
    r.head = partial - third;
    r.tail = (partial - r.head) - third;
    const double s = sine(r), c = cosine(r);
    switch (quarter_turns & 3) {
    case 0:
        return {s, c};
    case 1:
        return {c, -s};
    case 2:
        return {-s, -c};
    default:
        return {-c, s};
    }
}

Mat3 rotation_about(const Vec3& unit_axis, double angle) noexcept {
    const auto [s, c] = sin_cos(angle);
    Mat3 cross;
    cross << 0.0, -unit_axis[2], unit_axis[1], unit_axis[2], 0.0, -unit_axis[0], -unit_axis[1], unit_axis[0], 0.0;
    return c * Mat3::Identity() + s * cross + (1.0 - c) * unit_axis * unit_axis.transpose();
}

} // namespace trocar
