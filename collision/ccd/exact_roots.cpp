#include "collision/ccd/exact_roots.hpp"

#include <cassert>
#include <cmath>

namespace trocar::collision {
namespace {

using Bernstein = std::array<BigInteger, 4>;

/// Value at place / 2^depth, times 2^(depth degree).
BigInteger evaluate(const Polynomial& p, int degree, const BigInteger& place, int depth) {
    BigInteger value = p.coefficient[static_cast<std::size_t>(degree)];
    for (int k = degree - 1; k >= 0; --k)
        value = value * place + (p.coefficient[static_cast<std::size_t>(k)] << static_cast<std::size_t>(depth * (degree - k)));
    return value;
}

/// Coefficients on [place, place + 1] / 2^depth in Bernstein form, up to one positive factor.
Bernstein bernstein_on(const Polynomial& p, int degree, const BigInteger& place, int depth) {
    // Taylor's shift: c_k of p((place + s) / 2^depth) 2^(depth degree)
    std::array<BigInteger, 4> c;
    for (int k = 0; k <= degree; ++k)
        c[static_cast<std::size_t>(k)] = p.coefficient[static_cast<std::size_t>(k)] << static_cast<std::size_t>(depth * (degree - k));
    for (int i = 0; i < degree; ++i)
        for (int k = degree - 1; k >= i; --k) {
            const auto at = static_cast<std::size_t>(k);
            c[at] = c[at] + c[at + 1] * place;
        }
    if (degree <= 0) return {c[0], {}, {}, {}};
    if (degree == 1) return {c[0], c[0] + c[1], {}, {}};
    if (degree == 2) return {c[0] + c[0], c[0] + c[0] + c[1], (c[0] + c[1] + c[2]) << 1, {}};
    const BigInteger c0 = c[0] * 3, c1 = c0 + c[1];
    return {c0, c1, c1 + c[1] + c[2], (c[0] + c[1] + c[2] + c[3]) * 3};
}

int variations(const Bernstein& b, int degree) noexcept {
    int count = 0, last = 0;
    for (int k = 0; k <= degree; ++k) {
        const int sign = b[static_cast<std::size_t>(k)].sign();
        if (sign == 0) continue;
        count += last != 0 && sign != last;
        last = sign;
    }
    return count;
}

Polynomial derivative(const Polynomial& p) {
    Polynomial out;
    for (int k = 1; k < 4; ++k)
        out.coefficient[static_cast<std::size_t>(k - 1)] = p.coefficient[static_cast<std::size_t>(k)] * BigInteger(k);
    return out;
}

/// What is left of a times a power of b's leading coefficient squared (positive) after division by b; quotient likewise.
struct Division {
    Polynomial quotient, remainder;
};
Division pseudo_divide(const Polynomial& a, const Polynomial& b) {
    Division out{{}, a};
    const int degree_b = b.degree();
    const BigInteger& lead = b.coefficient[static_cast<std::size_t>(degree_b)];
    const BigInteger scale = lead * lead; // positive, so that signs stay
    for (int k = a.degree(); k >= degree_b; --k) {
        const BigInteger factor = out.remainder.coefficient[static_cast<std::size_t>(k)] * lead;
        for (BigInteger& c : out.quotient.coefficient) c = c * scale;
        for (BigInteger& c : out.remainder.coefficient) c = c * scale;
        out.quotient.coefficient[static_cast<std::size_t>(k - degree_b)] = factor;
        for (int i = 0; i <= degree_b; ++i) {
            BigInteger& c = out.remainder.coefficient[static_cast<std::size_t>(k - degree_b + i)];
            c = c - factor * b.coefficient[static_cast<std::size_t>(i)];
        }
    }
    return out;
}

/// Up to a constant factor; b may be zero.
Polynomial greatest_common_divisor(Polynomial a, Polynomial b) {
    while (!b.is_zero()) {
        Polynomial rest = pseudo_divide(a, b).remainder;
        a = std::move(b);
        b = std::move(rest);
    }
    return a;
}

/// The number of distinct roots stays, their order becomes one. A cubic with a double root has a zero discriminant, which is
/// cheaper to evaluate than the divisor.
Polynomial without_double_roots(const Polynomial& p) {
    if (p.degree() < 2) return p;
    const Polynomial common = greatest_common_divisor(p, derivative(p));
    return common.degree() < 1 ? p : pseudo_divide(p, common).quotient;
}

} // namespace

int Polynomial::degree() const noexcept {
    for (int k = 3; k >= 0; --k)
        if (!coefficient[static_cast<std::size_t>(k)].is_zero()) return k;
    return -1;
}

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
    Polynomial out;
    for (std::size_t k = 0; k < 4; ++k) out.coefficient[k] = a.coefficient[k] + b.coefficient[k];
    return out;
}

Polynomial operator-(const Polynomial& a, const Polynomial& b) {
    Polynomial out;
    for (std::size_t k = 0; k < 4; ++k) out.coefficient[k] = a.coefficient[k] - b.coefficient[k];
    return out;
}

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
    assert(a.degree() + b.degree() <= 3);
    Polynomial out;
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t k = 0; i + k < 4; ++k)
            if (!a.coefficient[i].is_zero() && !b.coefficient[k].is_zero())
                out.coefficient[i + k] = out.coefficient[i + k] + a.coefficient[i] * b.coefficient[k];
    return out;
}

double Root::value() const noexcept {
    const BigInteger twice = place + place;
    return exact ? place.to_double(depth) : (twice + BigInteger(1)).to_double(depth + 1);
}

RootList::RootList(const Polynomial& polynomial) : square_free_(polynomial), degree_(polynomial.degree()) {
    assert(degree_ >= 0);
    if (degree_ == 0) return;
    if (variations(bernstein_on(square_free_, degree_, 0, 0), degree_) > 1) {
        square_free_ = without_double_roots(polynomial);
        degree_ = square_free_.degree();
    }
    const Bernstein whole = bernstein_on(square_free_, degree_, 0, 0);
    if (whole[0].is_zero()) add({0, 0, true});
    isolate(whole, 0, 0);
    if (whole[static_cast<std::size_t>(degree_)].is_zero()) add({1, 0, true});
}

/// Roots strictly inside the interval.
void RootList::isolate(std::array<BigInteger, 4> b, const BigInteger& place, int depth) {
    const int count = variations(b, degree_);
    if (count == 0) return;
    if (count == 1) {
        int first = 0; // the interval's begin may itself be a root: the first coefficient that is not zero tells the sign after it
        for (std::size_t k = 0; first == 0; ++k) first = b[k].sign();
        add({place, depth, false, first});
        return;
    }
    // de Casteljau at one half, times 2^degree
    Bernstein left, right;
    const auto n = static_cast<std::size_t>(degree_);
    for (std::size_t level = 0; level <= n; ++level) {
        left[level] = b[0] << (n - level);
        right[n - level] = b[n - level] << (n - level);
        for (std::size_t k = 0; k + level < n; ++k) b[k] = b[k] + b[k + 1];
    }
    const BigInteger first = place + place, second = first + BigInteger(1);
    isolate(left, first, depth + 1);
    if (right[0].is_zero()) add({second, depth + 1, true});
    isolate(right, second, depth + 1);
}

void RootList::halve(Root& root) const {
    const BigInteger middle = root.place + root.place + BigInteger(1);
    const int at_middle = evaluate(square_free_, degree_, middle, root.depth + 1).sign();
    ++root.depth;
    if (at_middle == 0) {
        root.place = middle;
        root.exact = true;
        return;
    }
    root.place = at_middle == root.sign_before ? middle : middle - BigInteger(1);
}

void RootList::refine(Root& root, int bits) const {
    while (!root.exact && root.depth < bits) halve(root);
}

int RootList::sign_at(Root& root, const Polynomial& g) const {
    const int degree = g.degree();
    if (degree <= 0) return g.coefficient[0].sign();
    bool divisor_known = false;
    for (;; refine(root, root.depth + 16)) {
        if (root.exact) return evaluate(g, degree, root.place, root.depth).sign();
        const Bernstein b = bernstein_on(g, degree, root.place, root.depth);
        bool positive = true, negative = true;
        for (int k = 0; k <= degree; ++k) {
            positive = positive && b[static_cast<std::size_t>(k)].sign() > 0;
            negative = negative && b[static_cast<std::size_t>(k)].sign() < 0;
        }
        if (positive || negative) return positive ? 1 : -1;
        if (root.depth < 48 || divisor_known) continue;
        // Perhaps a common root: then the divisor of both has it, and changes its sign here as the square-free one does.
        divisor_known = true;
        const Polynomial common = greatest_common_divisor(square_free_, g);
        if (common.degree() < 1) continue;
        if (variations(bernstein_on(common, common.degree(), root.place, root.depth), common.degree()) % 2 == 1) return 0;
    }
}

} // namespace trocar::collision
