// A check of CLI11's options that CLI::Range lets pass: "nan" is below nothing and above nothing.
#pragma once

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdlib>
#include <string>

namespace seldinger::engine {

/// A number from least to most, both included, and no NaN.
[[nodiscard]] inline CLI::Validator number_range(double least, double most) {
    const auto no_nan = [](std::string& text) { return std::isnan(std::strtod(text.c_str(), nullptr)) ? text + " is no number" : ""; };
    return CLI::Range(least, most) & CLI::Validator(no_nan, "");
}

} // namespace seldinger::engine
