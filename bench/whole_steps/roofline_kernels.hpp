// The two loops of a roofline, for the best instruction set of this processor.
#pragma once

#include <cstddef>

namespace trocar::engine {

/// a[i] = b[i] + factor c[i]; count a multiple of 8, arrays on 64 bytes
void run_triad(double* a, const double* b, const double* c, double factor, std::size_t count) noexcept;

/// `rounds` times sixteen independent fused multiply-adds of vectors.
/// returns  floating-point operations done; `result` keeps the compiler from leaving them out
[[nodiscard]] double run_multiply_adds(std::size_t rounds, double& result) noexcept;

} // namespace trocar::engine
