// Checks of CLI11's options: numbers, of which CLI::Range lets "nan" pass, and budgets.
#pragma once

#include "engine/scene/settings.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <string>

namespace trocar::engine {

/// A number from least to most, both included, and no NaN.
[[nodiscard]] inline CLI::Validator number_range(double least, double most) {
    const auto no_nan = [](std::string& text) { return std::isnan(std::strtod(text.c_str(), nullptr)) ? text + " is no number" : ""; };
    return CLI::Range(least, most) & CLI::Validator(no_nan, "");
}

/// 0, which means something of its own, or a number from least to most.
[[nodiscard]] inline CLI::Validator zero_or_range(double least, double most) {
    const auto check = [least, most](std::string& text) -> std::string {
        char* end = nullptr;
        const double number = std::strtod(text.c_str(), &end);
        if (end != text.c_str() && *end == '\0' && (number == 0.0 || (number >= least && number <= most))) return {};
        return fmt::format("found {}; expected 0, or {:g} to {:g}", text, least, most);
    };
    return {check, fmt::format("0 or [{:g} - {:g}]", least, most)};
}

/// A time, work:TESTS, or exact.
[[nodiscard]] inline CLI::Validator budget_text() {
    const auto check = [](std::string& text) -> std::string {
        const auto budget = parse_budget(text.empty() ? "exact" : text); // that a value is empty is said elsewhere
        return budget ? "" : budget.error().message;
    };
    return {check, ""};
}

} // namespace trocar::engine
