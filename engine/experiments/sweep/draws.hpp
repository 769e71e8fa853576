// Values of ranges and random draws, the same on every machine.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// count numbers from `from` to `to`, as JSON, rounded to 12 significant digits so that 0.3 in three steps holds 0.1 and 0.2.
/// log  even ratios; both above 0
[[nodiscard]] std::vector<std::string> range_values(double from, double to, std::size_t count, bool log);

/// A stream of random numbers for one pointer of a sweep.
class DrawStream {
public:
    DrawStream(std::uint64_t seed, std::string_view pointer);
    [[nodiscard]] double uniform();                            // [0, 1)
    [[nodiscard]] double normal();                             // mean 0, deviation 1
    [[nodiscard]] std::uint64_t below(std::uint64_t count);    // 0 .. count - 1, without bias

private:
    [[nodiscard]] std::uint64_t next();
    std::uint64_t state_;
};

/// A number as JSON, rounded to 12 significant digits.
[[nodiscard]] std::string number_json(double value);

} // namespace trocar::engine
