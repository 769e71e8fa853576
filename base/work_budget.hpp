// Kernels spend work units; only engine/time knows a clock and turns microseconds into grants of units.
#pragma once

#include <cstdint>
#include <limits>

namespace trocar {

/// A count of elementary operations that a kernel may still do. Interruption is the kernel seeing spend() return false.
class WorkBudget {
public:
    static constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

    explicit constexpr WorkBudget(std::uint64_t units = kUnlimited) noexcept : left_(units) {}

    /// Takes `units`, or nothing when less is left.
    [[nodiscard]] constexpr bool spend(std::uint64_t units) noexcept {
        if (units > left_) return false;
        if (left_ != kUnlimited) left_ -= units;
        spent_ += units;
        return true;
    }
    [[nodiscard]] constexpr std::uint64_t left() const noexcept { return left_; }
    [[nodiscard]] constexpr std::uint64_t spent() const noexcept { return spent_; }
    constexpr void grant(std::uint64_t units) noexcept { left_ = units > kUnlimited - left_ ? kUnlimited : left_ + units; }

private:
    std::uint64_t left_;
    std::uint64_t spent_ = 0;
};

} // namespace trocar
