#include "engine/experiments/sweep/draws.hpp"

#include "engine/state/bit_hash.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

namespace trocar::engine {

std::string number_json(double value) {
    const bool is_long_integer = std::abs(value) >= 1e12 && value == std::floor(value); // a seed: each of its digits counts
    const double rounded = is_long_integer ? value : std::strtod(fmt::format("{:.12g}", value).c_str(), nullptr);
    return rounded == 0.0 ? "0" : fmt::format("{}", rounded);
}

std::vector<std::string> range_values(double from, double to, std::size_t count, bool log) {
    std::vector<std::string> values;
    for (std::size_t i = 0; i < count; ++i) {
        const double share = count > 1 ? static_cast<double>(i) / static_cast<double>(count - 1) : 0.0;
        double value = log ? from * std::exp(share * std::log(to / from)) : from + (to - from) * share;
        if (i + 1 == count && count > 1) value = to;
        values.push_back(number_json(value));
    }
    return values;
}

DrawStream::DrawStream(std::uint64_t seed, std::string_view pointer) : state_(0) {
    BitHash hash;
    hash.add(seed);
    hash.add_text(pointer);
    state_ = hash.value();
}

/// source  Steele, Lea & Flood 2014, SplitMix64
std::uint64_t DrawStream::next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
}

double DrawStream::uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }

/// source  Marsaglia's polar method; the second number is not kept, so that a draw's place in the stream does not matter to the next
double DrawStream::normal() {
    for (;;) {
        const double u = 2.0 * uniform() - 1.0, v = 2.0 * uniform() - 1.0, s = u * u + v * v;
        if (s > 0.0 && s < 1.0) return u * std::sqrt(-2.0 * std::log(s) / s);
    }
}

std::uint64_t DrawStream::below(std::uint64_t count) {
    const std::uint64_t limit = ~std::uint64_t{0} - ~std::uint64_t{0} % count;
    for (;;)
        if (const std::uint64_t value = next(); value < limit) return value % count;
}

} // namespace trocar::engine
