// What is fuzzed: every reader, and the elementary tests against rational arithmetic. A target takes any bytes, and aborts with a
// sentence where a promise is broken; crashes, leaks and undefined behaviour are the sanitizers' to see.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::fuzz {

struct Target {
    std::string_view name;
    void (*run)(std::string_view bytes);
    std::size_t most_bytes; // longer inputs only take longer
};

[[nodiscard]] std::span<const Target> targets();

/// Inputs to start from: something sound in every dialect, and what was found once. Made here, so that no binary file has to be kept.
[[nodiscard]] std::vector<std::string> seeds_of(std::string_view target);

} // namespace trocar::fuzz
