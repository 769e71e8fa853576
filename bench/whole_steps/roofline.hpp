// What this machine can do at most on one core: memory bandwidth from every level of its caches, and arithmetic.
// source   Williams, Waterman & Patterson 2009, "Roofline"; the triad of McCalpin's STREAM 1995
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace trocar::engine {

/// A triad a = b + s c over arrays that fit there.
struct MemoryLevel {
    std::string name;
    std::size_t bytes = 0; // of a level's three arrays together
    std::size_t holds = 0; // bytes; what is larger comes from the next level
    double gb_per_s = 0.0; // 24 bytes an element: what a store reads of its line first is not counted
};

struct Roofline {
    std::vector<MemoryLevel> levels; // nearest first; the last is memory itself
    double peak_gflops = 0.0;        // fused multiply-adds of doubles, each two

    [[nodiscard]] const MemoryLevel& level_of(std::size_t working_set) const noexcept;
    /// GFLOP/s at most of what does so many operations on a byte and works on so many bytes.
    [[nodiscard]] double roof(double flops_per_byte, std::size_t working_set) const noexcept;
};

/// quick: small arrays and short times, for tests
[[nodiscard]] Roofline measure_roofline(bool quick);

} // namespace trocar::engine
