// The generator's random numbers: SplitMix64 (Steele, Lea, Flood 2014), the same sequence on every machine.
#pragma once

#include "base/vec.hpp"

#include <cstdint>

namespace trocar::anatomy {

class Random {
public:
    explicit constexpr Random(std::uint64_t seed) noexcept : state_(seed) {}

    [[nodiscard]] constexpr std::uint64_t next() noexcept {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
        return z ^ (z >> 31);
    }
    /// In [0, 1).
    [[nodiscard]] constexpr double uniform() noexcept { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
    [[nodiscard]] constexpr double uniform(double least, double most) noexcept { return least + (most - least) * uniform(); }
    /// Uniform in [-1, 1]^3.
    [[nodiscard]] Vec3 cube() noexcept {
        const double x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
        return {x, y, z};
    }

private:
    std::uint64_t state_;
};

} // namespace trocar::anatomy
