#include "bench/whole_steps/roofline_kernels.hpp"

#include <array>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4) // neither has fused multiply-adds
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/whole_steps/roofline_kernels.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace trocar::engine {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Doubles = hn::CappedTag<double, 8>;

void triad(double* a, const double* b, const double* c, double factor, std::size_t count) {
    const Doubles d;
    const auto s = hn::Set(d, factor);
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) hn::Store(hn::MulAdd(s, hn::Load(d, c + i), hn::Load(d, b + i)), d, a + i);
}

/// Sixteen chains: more than latency times units of any processor so far.
double multiply_adds(std::size_t rounds, double& result) {
    const Doubles d;
    constexpr std::size_t kChains = 16;
    using Vector = hn::Vec<Doubles>;
    const Vector factor = hn::Set(d, 0.999), add = hn::Set(d, 1e-3);
    Vector x0 = hn::Set(d, 0.0), x1 = x0, x2 = x0, x3 = x0, x4 = x0, x5 = x0, x6 = x0, x7 = x0;
    Vector y0 = x0, y1 = x0, y2 = x0, y3 = x0, y4 = x0, y5 = x0, y6 = x0, y7 = x0;
    for (std::size_t k = 0; k < rounds; ++k) {
        x0 = hn::MulAdd(x0, factor, add), x1 = hn::MulAdd(x1, factor, add), x2 = hn::MulAdd(x2, factor, add), x3 = hn::MulAdd(x3, factor, add);
        x4 = hn::MulAdd(x4, factor, add), x5 = hn::MulAdd(x5, factor, add), x6 = hn::MulAdd(x6, factor, add), x7 = hn::MulAdd(x7, factor, add);
        y0 = hn::MulAdd(y0, factor, add), y1 = hn::MulAdd(y1, factor, add), y2 = hn::MulAdd(y2, factor, add), y3 = hn::MulAdd(y3, factor, add);
        y4 = hn::MulAdd(y4, factor, add), y5 = hn::MulAdd(y5, factor, add), y6 = hn::MulAdd(y6, factor, add), y7 = hn::MulAdd(y7, factor, add);
    }
    const Vector x = hn::Add(hn::Add(hn::Add(x0, x1), hn::Add(x2, x3)), hn::Add(hn::Add(x4, x5), hn::Add(x6, x7)));
    const Vector y = hn::Add(hn::Add(hn::Add(y0, y1), hn::Add(y2, y3)), hn::Add(hn::Add(y4, y5), hn::Add(y6, y7)));
    result = hn::GetLane(hn::SumOfLanes(d, hn::Add(x, y)));
    return 2.0 * static_cast<double>(kChains * hn::Lanes(d)) * static_cast<double>(rounds);
}

} // namespace HWY_NAMESPACE
} // namespace trocar::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar::engine {

namespace {

HWY_EXPORT(triad);
HWY_EXPORT(multiply_adds);

} // namespace

void run_triad(double* a, const double* b, const double* c, double factor, std::size_t count) noexcept {
    HWY_DYNAMIC_DISPATCH(triad)(a, b, c, factor, count);
}

double run_multiply_adds(std::size_t rounds, double& result) noexcept { return HWY_DYNAMIC_DISPATCH(multiply_adds)(rounds, result); }

} // namespace trocar::engine
#endif
