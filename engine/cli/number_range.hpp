// A check of CLI11's options that CLI::Range lets pass: "nan" is below nothing and above nothing.
#pragma once

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <string>

namespace seldinger::engine {

/// A number from least to most, both included, and no NaN.
[[nodiscard]] inline CLI::Validator number_range(double least, double most) {
    const std::string range = fmt::format("{:g} to {:g}", least, most);
    const auto check = [=](std::string& text) {
        double value = 0.0;
        if (!CLI::detail::lexical_cast(text, value)) return fmt::format("'{}' is no number; {} would be right", text, range);
        return value >= least && value <= most ? std::string() : fmt::format("found {}; {} would be right", text, range);
    };
    return CLI::Validator(check, fmt::format("[{:g} - {:g}]", least, most));
}

} // namespace seldinger::engine
