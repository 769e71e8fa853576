// Filter first: a determinant in doubles is off by at most a small multiple of the same expression over absolute values
// (Shewchuk 1997, error bounds A). Where that does not decide the sign, the determinant is summed exactly as an expansion:
// a sum of doubles of growing magnitude that do not overlap, whose sign is that of the last one.
#include "base/predicates.hpp"

#include <cmath>

namespace trocar {
namespace {

constexpr double kHalfUlp = 0x1p-53;
constexpr double kBound2d = (3.0 + 16.0 * kHalfUlp) * kHalfUlp; // Shewchuk, ccwerrboundA
constexpr double kBound3d = (7.0 + 56.0 * kHalfUlp) * kHalfUlp; // Shewchuk, o3derrboundA

struct Exact {
    double rounded, error; // their sum is the exact result
};

Exact sum_exactly(double a, double b) noexcept {
    const double sum = a + b;
    const double b_part = sum - a;
    const double a_part = sum - b_part;
    return {sum, (a - a_part) + (b - b_part)};
}

Exact multiply_exactly(double a, double b) noexcept {
    const double product = a * b;
    return {product, std::fma(a, b, -product)};
}

/// Components by growing magnitude, without zeros.
template <int Capacity>
struct Expansion {
    std::array<double, Capacity> part;
    int size = 0;

    void push(double value) noexcept {
        if (value != 0.0) part[static_cast<std::size_t>(size++)] = value;
    }
    [[nodiscard]] double operator[](int i) const noexcept { return part[static_cast<std::size_t>(i)]; }
    [[nodiscard]] int sign() const noexcept { return size == 0 ? 0 : ((*this)[size - 1] > 0.0 ? 1 : -1); }
};

Expansion<2> difference(double a, double b) noexcept {
    const Exact d = sum_exactly(a, -b);
    Expansion<2> out;
    out.push(d.error);
    out.push(d.rounded);
    return out;
}

/// Shewchuk's fast expansion sum: merge by magnitude, then carry upwards.
template <int M, int N>
Expansion<M + N> add(const Expansion<M>& e, const Expansion<N>& f) noexcept {
    Expansion<M + N> out;
    int i = 0, j = 0;
    const auto next = [&] {
        if (j >= f.size || (i < e.size && std::abs(e[i]) < std::abs(f[j]))) return e[i++];
        return f[j++];
    };
    if (e.size + f.size == 0) return out;
    double carry = next();
    while (i < e.size || j < f.size) {
        const Exact s = sum_exactly(next(), carry);
        out.push(s.error);
        carry = s.rounded;
    }
    out.push(carry);
    return out;
}

template <int N>
Expansion<2 * N> scale(const Expansion<N>& e, double factor) noexcept {
    Expansion<2 * N> out;
    if (e.size == 0) return out;
    Exact first = multiply_exactly(e[0], factor);
    out.push(first.error);
    double carry = first.rounded;
    for (int i = 1; i < e.size; ++i) {
        const Exact product = multiply_exactly(e[i], factor);
        const Exact low = sum_exactly(carry, product.error);
        out.push(low.error);
        const Exact high = sum_exactly(product.rounded, low.rounded);
        out.push(high.error);
        carry = high.rounded;
    }
    out.push(carry);
    return out;
}

template <int N>
Expansion<4 * N> multiply(const Expansion<N>& e, const Expansion<2>& f) noexcept {
    Expansion<2 * N> low, high;
    if (f.size > 0) low = scale(e, f[0]);
    if (f.size > 1) high = scale(e, f[1]);
    return add(low, high);
}

template <int N>
Expansion<N> negate(Expansion<N> e) noexcept {
    for (int i = 0; i < e.size; ++i) e.part[static_cast<std::size_t>(i)] = -e.part[static_cast<std::size_t>(i)];
    return e;
}

using Differences = std::array<Expansion<2>, 3>;

Differences differences(const Vec3& a, const Vec3& b) noexcept {
    return {difference(a[0], b[0]), difference(a[1], b[1]), difference(a[2], b[2])};
}

Expansion<16> minor2(const Expansion<2>& a, const Expansion<2>& b, const Expansion<2>& c, const Expansion<2>& d) noexcept {
    return add(multiply(a, d), negate(multiply(b, c)));
}

int orient3d_exact(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) noexcept {
    const Differences u = differences(b, a), v = differences(c, a), w = differences(d, a);
    const auto x = multiply(minor2(v[1], v[2], w[1], w[2]), u[0]);
    const auto y = multiply(minor2(v[2], v[0], w[2], w[0]), u[1]);
    const auto z = multiply(minor2(v[0], v[1], w[0], w[1]), u[2]);
    return add(add(x, y), z).sign();
}

int sign_of(double value) noexcept { return value > 0.0 ? 1 : -1; }

} // namespace

int orient2d(const Point2& a, const Point2& b, const Point2& c) noexcept {
    const double left = (a.x - c.x) * (b.y - c.y);
    const double right = (a.y - c.y) * (b.x - c.x);
    const double det = left - right;
    if (std::abs(det) > kBound2d * (std::abs(left) + std::abs(right))) return sign_of(det);
    return minor2(difference(a.x, c.x), difference(a.y, c.y), difference(b.x, c.x), difference(b.y, c.y)).sign();
}

int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) noexcept {
    const Vec3 u = b - a, v = c - a, w = d - a;
    const double x0 = v[1] * w[2], x1 = v[2] * w[1];
    const double y0 = v[2] * w[0], y1 = v[0] * w[2];
    const double z0 = v[0] * w[1], z1 = v[1] * w[0];
    const double det = u[0] * (x0 - x1) + u[1] * (y0 - y1) + u[2] * (z0 - z1);
    const double permanent = (std::abs(x0) + std::abs(x1)) * std::abs(u[0]) + (std::abs(y0) + std::abs(y1)) * std::abs(u[1]) +
                             (std::abs(z0) + std::abs(z1)) * std::abs(u[2]);
    if (std::abs(det) > kBound3d * permanent) return sign_of(det);
    return orient3d_exact(a, b, c, d);
}

bool are_collinear(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    for (int axis = 0; axis < 3; ++axis) {
        const int i = (axis + 1) % 3, j = (axis + 2) % 3;
        if (orient2d({a[i], a[j]}, {b[i], b[j]}, {c[i], c[j]}) != 0) return false;
    }
    return true;
}

} // namespace trocar
