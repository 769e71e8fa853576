// Integers of any size, for the few verdicts that floating point cannot decide: every double is an integer times a
// power of two, so with one common exponent all of a test's polynomials have integer coefficients.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace trocar::collision {

/// Sign and magnitude, 64 bits a limb, lowest first. Short numbers live inside the object, long ones on the heap.
/// fails   only by std::bad_alloc
class BigInteger {
public:
    BigInteger() noexcept = default;
    BigInteger(std::int64_t value) noexcept; // NOLINT(google-explicit-constructor)
    BigInteger(const BigInteger& other) { *this = other; }
    BigInteger(BigInteger&& other) noexcept { *this = std::move(other); }
    BigInteger& operator=(const BigInteger& other);
    BigInteger& operator=(BigInteger&& other) noexcept;
    ~BigInteger() = default;

    /// value * 2^-exponent. The exponent must be at most lowest_exponent(value), else bits would be lost (assert).
    [[nodiscard]] static BigInteger from_double(double value, int exponent);

    [[nodiscard]] int sign() const noexcept { return count_ == 0 ? 0 : negative_ ? -1 : 1; }
    [[nodiscard]] bool is_zero() const noexcept { return count_ == 0; }
    [[nodiscard]] std::size_t bits() const noexcept; // of the magnitude; 0 for zero
    /// Rounded towards zero to 53 bits, divided by 2^shift; infinite where that is too large.
    [[nodiscard]] double to_double(int shift) const noexcept;

    [[nodiscard]] BigInteger operator-() const;
    [[nodiscard]] BigInteger operator<<(std::size_t bits) const;
    friend BigInteger operator+(const BigInteger& a, const BigInteger& b) { return sum(a, b, false); }
    friend BigInteger operator-(const BigInteger& a, const BigInteger& b) { return sum(a, b, true); }
    friend BigInteger operator*(const BigInteger& a, const BigInteger& b);
    friend bool operator==(const BigInteger& a, const BigInteger& b) noexcept;

private:
    /// Limbs without the heap: a cubic's coefficients over coordinates of one order of magnitude need 4, their remainders 23. A coordinate
    /// that has decayed to nearly nothing, as a rod's across a straight vessel, lengthens all of a test's numbers: 64 were too few there.
    static constexpr std::size_t kInside = 256;

    [[nodiscard]] std::span<const std::uint64_t> limbs() const noexcept { return {far_.empty() ? near_.data() : far_.data(), count_}; }
    std::uint64_t* make_limbs(std::size_t count);
    void trim() noexcept;
    static BigInteger sum(const BigInteger& a, const BigInteger& b, bool negate_b);
    static int compare_magnitudes(const BigInteger& a, const BigInteger& b) noexcept;

    std::array<std::uint64_t, kInside> near_; // those beyond count_ are never read, nor copied
    std::vector<std::uint64_t> far_; // empty: near_ holds the limbs
    std::size_t count_ = 0;
    bool negative_ = false;
};

/// Largest e for which value is an integer multiple of 2^e; a large number for 0.
[[nodiscard]] int lowest_exponent(double value) noexcept;

} // namespace trocar::collision
