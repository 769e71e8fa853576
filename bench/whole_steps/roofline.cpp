#include "bench/whole_steps/roofline.hpp"

#include "bench/whole_steps/roofline_kernels.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <new>

namespace trocar::engine {

namespace {

constexpr std::size_t kLine = 64; // bytes of a cache line, and of the widest vector

struct FreeAligned {
    void operator()(double* array) const noexcept { ::operator delete(array, std::align_val_t{kLine}); }
};
using AlignedArray = std::unique_ptr<double, FreeAligned>;

AlignedArray make_array(std::size_t count, double value) {
    AlignedArray array(static_cast<double*>(::operator new(count * sizeof(double), std::align_val_t{kLine})));
    std::fill_n(array.get(), count, value); // its pages are there before anything is timed
    return array;
}

/// s; the shortest of some calls: what disturbs a loop only makes it longer.
template <class Loop>
double shortest(std::size_t calls, Loop&& loop) {
    double best = 1e300;
    for (std::size_t k = 0; k < calls; ++k) {
        const std::int64_t begin = thread_cpu_ns();
        loop();
        best = std::min(best, 1e-9 * static_cast<double>(thread_cpu_ns() - begin));
    }
    return best;
}

double measure_triad(std::size_t bytes, bool quick) {
    const std::size_t count = std::max<std::size_t>(8, bytes / (3 * sizeof(double)) / 8 * 8);
    const AlignedArray a = make_array(count, 0.0), b = make_array(count, 1.0), c = make_array(count, 2.0);
    const std::size_t repeats = 1 + (quick ? std::size_t{1} << 16 : std::size_t{1} << 24) / count; // reading the clock costs nothing beside them
    const double seconds = shortest(quick ? 2 : 7, [&] {
        for (std::size_t k = 0; k < repeats; ++k) run_triad(a.get(), b.get(), c.get(), 0.5, count);
    });
    return 3e-9 * static_cast<double>(sizeof(double) * count * repeats) / seconds;
}

double measure_peak(bool quick) {
    double result = 0.0, operations = 0.0;
    const double seconds = shortest(quick ? 2 : 7, [&] { operations = run_multiply_adds(quick ? 10'000 : 2'000'000, result); });
    return result != 0.0 ? 1e-9 * operations / seconds : 0.0;
}

/// Bytes of the first core's data cache of this level; `otherwise` where the system does not say. (sysconf names the host's in a virtual machine.)
std::size_t cache_size(int level, std::size_t otherwise) {
    for (int index = 0; index < 8; ++index) {
        const std::string folder = fmt::format("/sys/devices/system/cpu/cpu0/cache/index{}/", index);
        int of_level = 0;
        std::size_t kib = 0; // "32768K"
        std::string type;
        std::ifstream(folder + "level") >> of_level;
        std::ifstream(folder + "type") >> type;
        std::ifstream(folder + "size") >> kib;
        if (of_level == level && type != "Instruction" && kib > 0) return kib << 10;
    }
    return otherwise;
}

} // namespace

const MemoryLevel& Roofline::level_of(std::size_t working_set) const noexcept {
    for (const MemoryLevel& level : levels)
        if (working_set <= level.holds) return level;
    return levels.back();
}

double Roofline::roof(double flops_per_byte, std::size_t working_set) const noexcept {
    return std::min(peak_gflops, flops_per_byte * level_of(working_set).gb_per_s);
}

Roofline measure_roofline(bool quick) {
    const std::size_t first = cache_size(1, std::size_t{32} << 10), second = cache_size(2, std::size_t{1} << 20);
    const std::size_t last = std::max(cache_size(3, std::size_t{32} << 20), 2 * second);
    Roofline roofline;
    // Half of a cache is the triad's: the other half is whatever else the core and its neighbours keep there.
    roofline.levels = {{"first-level cache", first / 2, first, 0.0}, {"second-level cache", second / 2, second, 0.0}, {"last cache", last / 2, last, 0.0},
                       {"memory", quick ? 2 * last : 12 * last, static_cast<std::size_t>(-1), 0.0}};
    for (MemoryLevel& level : roofline.levels) level.gb_per_s = measure_triad(level.bytes, quick);
    roofline.peak_gflops = measure_peak(quick);
    return roofline;
}

} // namespace trocar::engine
