// Roots in [0, 1] of polynomials with integer coefficients, up to degree 3, and the sign of another polynomial there: decided, never
// estimated.
// source   Descartes' rule of signs in Bernstein form: Rouillier, Zimmermann, "Efficient isolation of polynomial's real roots" (2004).
#pragma once

#include "collision/ccd/big_integer.hpp"

#include <array>
#include <span>
#include <utility>

namespace trocar::collision {

struct Polynomial {
    std::array<BigInteger, 4> coefficient; // of 1, t, t^2, t^3

    [[nodiscard]] int degree() const noexcept; // -1: zero everywhere
    [[nodiscard]] bool is_zero() const noexcept { return degree() < 0; }
};

[[nodiscard]] Polynomial operator+(const Polynomial& a, const Polynomial& b);
[[nodiscard]] Polynomial operator-(const Polynomial& a, const Polynomial& b);
/// The degrees must add up to 3 at most.
[[nodiscard]] Polynomial operator*(const Polynomial& a, const Polynomial& b);

/// One root: in the open interval (place, place + 1) / 2^depth, or exactly place / 2^depth.
struct Root {
    BigInteger place;
    int depth = 0;
    bool exact = false;
    int sign_before = 0; // of the square-free polynomial, between the interval's begin and the root

    [[nodiscard]] double value() const noexcept;
};

/// A polynomial without double roots, and its roots in [0, 1], ascending.
class RootList {
public:
    /// polynomial   not zero
    explicit RootList(const Polynomial& polynomial);

    [[nodiscard]] std::span<Root> roots() noexcept { return std::span(roots_).first(count_); }
    /// Halves the root's interval until it is 2^-bits wide, or the root is hit.
    void refine(Root& root, int bits) const;
    /// Sign of g at the root, exactly. Refines the root where that is needed.
    [[nodiscard]] int sign_at(Root& root, const Polynomial& g) const;

private:
    void isolate(std::array<BigInteger, 4> bernstein, const BigInteger& place, int depth);
    void halve(Root& root) const;
    void add(Root root) { roots_[count_++] = std::move(root); }

    Polynomial square_free_;
    int degree_ = 0;
    std::array<Root, 3> roots_; // no more than the degree
    std::size_t count_ = 0;
};

} // namespace trocar::collision
