#include "collision/ccd/big_integer.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

namespace trocar::collision {
namespace {

using Wide = unsigned __int128;

constexpr int kLimbBits = 64;

} // namespace

BigInteger& BigInteger::operator=(const BigInteger& other) {
    if (this == &other) return *this;
    std::copy_n(other.limbs().data(), other.count_, make_limbs(other.count_));
    negative_ = other.negative_;
    return *this;
}

BigInteger& BigInteger::operator=(BigInteger&& other) noexcept {
    if (this == &other) return *this;
    far_ = std::move(other.far_);
    count_ = std::exchange(other.count_, 0);
    negative_ = std::exchange(other.negative_, false);
    if (far_.empty()) std::copy_n(other.near_.begin(), count_, near_.begin());
    other.far_.clear();
    return *this;
}

BigInteger::BigInteger(std::int64_t value) noexcept : negative_(value < 0) {
    if (value == 0) return;
    near_[0] = negative_ ? ~static_cast<std::uint64_t>(value) + 1 : static_cast<std::uint64_t>(value);
    count_ = 1;
}

std::uint64_t* BigInteger::make_limbs(std::size_t count) {
    count_ = count;
    if (count <= kInside) {
        far_.clear();
        return near_.data();
    }
    far_.assign(count, 0);
    return far_.data();
}

void BigInteger::trim() noexcept {
    const std::uint64_t* limb = far_.empty() ? near_.data() : far_.data();
    while (count_ > 0 && limb[count_ - 1] == 0) --count_;
    if (count_ == 0) negative_ = false;
}

int lowest_exponent(double value) noexcept {
    if (value == 0.0) return std::numeric_limits<int>::max();
    int exponent = 0;
    const double mantissa = std::frexp(std::abs(value), &exponent);
    const auto whole = static_cast<std::uint64_t>(std::ldexp(mantissa, 53));
    return exponent - 53 + std::countr_zero(whole);
}

BigInteger BigInteger::from_double(double value, int exponent) {
    if (value == 0.0) return {};
    const int lowest = lowest_exponent(value);
    assert(exponent <= lowest && std::isfinite(value));
    const auto whole = static_cast<std::int64_t>(std::ldexp(value, -lowest)); // odd, below 2^53
    return BigInteger(whole) << static_cast<std::size_t>(lowest - exponent);
}

std::size_t BigInteger::bits() const noexcept {
    if (count_ == 0) return 0;
    return kLimbBits * count_ - static_cast<std::size_t>(std::countl_zero(limbs()[count_ - 1]));
}

double BigInteger::to_double(int shift) const noexcept {
    if (count_ == 0) return 0.0;
    const auto limb = limbs();
    const int empty = std::countl_zero(limb[count_ - 1]);
    std::uint64_t highest = limb[count_ - 1] << empty; // the 64 highest bits
    if (empty > 0 && count_ > 1) highest |= limb[count_ - 2] >> (kLimbBits - empty);
    constexpr std::uint64_t kBeyond53 = 0x7ff;
    const double value = std::ldexp(static_cast<double>(highest & ~kBeyond53), static_cast<int>(bits()) - kLimbBits - shift);
    return negative_ ? -value : value;
}

BigInteger BigInteger::operator-() const {
    BigInteger out = *this;
    out.negative_ = count_ > 0 && !negative_;
    return out;
}

BigInteger BigInteger::operator<<(std::size_t bits) const {
    BigInteger out;
    if (count_ == 0) return out;
    const std::size_t words = bits / kLimbBits;
    const int rest = static_cast<int>(bits % kLimbBits);
    const auto in = limbs();
    std::uint64_t* limb = out.make_limbs(count_ + words + 1);
    std::fill(limb, limb + words, 0);
    std::uint64_t carry = 0;
    for (std::size_t i = 0; i < in.size(); ++i) {
        limb[words + i] = (in[i] << rest) | carry;
        carry = rest == 0 ? 0 : in[i] >> (kLimbBits - rest);
    }
    limb[words + in.size()] = carry;
    out.negative_ = negative_;
    out.trim();
    return out;
}

int BigInteger::compare_magnitudes(const BigInteger& a, const BigInteger& b) noexcept {
    if (a.count_ != b.count_) return a.count_ < b.count_ ? -1 : 1;
    const auto left = a.limbs(), right = b.limbs();
    for (std::size_t i = left.size(); i-- > 0;)
        if (left[i] != right[i]) return left[i] < right[i] ? -1 : 1;
    return 0;
}

BigInteger BigInteger::sum(const BigInteger& a, const BigInteger& b, bool negate_b) {
    const bool b_negative = b.negative_ != negate_b;
    BigInteger out;
    const bool same_sign = a.negative_ == b_negative || a.count_ == 0 || b.count_ == 0;
    const int order = compare_magnitudes(a, b);
    const auto large = order >= 0 ? a.limbs() : b.limbs(), small = order >= 0 ? b.limbs() : a.limbs();
    out.negative_ = order >= 0 && a.count_ > 0 ? a.negative_ : b_negative;
    std::uint64_t* limb = out.make_limbs(large.size() + 1);
    std::uint64_t carry = 0;
    for (std::size_t i = 0; i < large.size(); ++i) {
        const std::uint64_t other = i < small.size() ? small[i] : 0;
        const Wide result = same_sign ? static_cast<Wide>(large[i]) + other + carry : static_cast<Wide>(large[i]) - other - carry;
        limb[i] = static_cast<std::uint64_t>(result);
        carry = static_cast<std::uint64_t>(result >> kLimbBits) & 1u;
    }
    limb[large.size()] = same_sign ? carry : 0;
    out.trim();
    return out;
}

BigInteger operator*(const BigInteger& a, const BigInteger& b) {
    BigInteger out;
    if (a.count_ == 0 || b.count_ == 0) return out;
    const auto left = a.limbs(), right = b.limbs();
    std::uint64_t* limb = out.make_limbs(left.size() + right.size());
    std::fill(limb, limb + left.size() + right.size(), 0);
    for (std::size_t i = 0; i < left.size(); ++i) {
        std::uint64_t carry = 0;
        for (std::size_t k = 0; k < right.size(); ++k) {
            const Wide value = static_cast<Wide>(left[i]) * right[k] + limb[i + k] + carry;
            limb[i + k] = static_cast<std::uint64_t>(value);
            carry = static_cast<std::uint64_t>(value >> kLimbBits);
        }
        limb[i + right.size()] = carry;
    }
    out.negative_ = a.negative_ != b.negative_;
    out.trim();
    return out;
}

bool operator==(const BigInteger& a, const BigInteger& b) noexcept {
    return a.negative_ == b.negative_ && BigInteger::compare_magnitudes(a, b) == 0;
}

} // namespace trocar::collision
