#include "engine/scene/settings.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

namespace trocar::engine {
namespace {

constexpr std::array<std::pair<std::string_view, double>, 5> kTimeUnits = {
    {{"ns", 1e-9}, {"us", 1e-6}, {"\xC2\xB5s", 1e-6}, {"ms", 1e-3}, {"s", 1.0}}};

/// More tests than a processor does in a year.
constexpr std::uint64_t kMaxWorkUnits = 1'000'000'000'000'000;

constexpr std::string_view kRight = "expected a time with its unit (\"8ms\", \"250us\"), \"work:20000\" or \"exact\"";

Error refuse(std::string_view text, std::string_view reason) {
    return {ErrorCode::BadValue, fmt::format("budget \"{:.40}\": {}; {}", text, reason, kRight)};
}

Result<BudgetSpec> parse_work(std::string_view text, std::string_view digits) {
    std::uint64_t units = 0;
    const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), units);
    if (!digits.empty() && digits.front() == '-') return refuse(text, "negative");
    if (problem == std::errc::result_out_of_range || units > kMaxWorkUnits) return refuse(text, "more than 10^15 tests are no limit");
    if (problem != std::errc() || end != digits.data() + digits.size())
        return refuse(text, "the number of sphere-pair tests, an integer, must follow work:");
    return BudgetSpec{{BudgetMode::Work, 0.0, units}};
}

std::optional<double> find_time_unit(std::string_view name) {
    for (const auto& [unit, factor] : kTimeUnits)
        if (unit == name) return factor;
    return std::nullopt;
}

} // namespace

Result<BudgetSpec> parse_budget(std::string_view text) {
    if (text == "exact") return BudgetSpec{};
    if (text.substr(0, 5) == "work:") return parse_work(text, text.substr(5));
    double value = 0.0;
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (problem == std::errc::result_out_of_range) return refuse(text, "out of range");
    if (problem != std::errc()) return refuse(text, "not understood");
    std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
    while (!unit.empty() && unit.front() == ' ') unit.remove_prefix(1);
    if (!std::isfinite(value)) return refuse(text, "not finite");
    if (unit.empty()) return refuse(text, "without a unit");
    const std::optional<double> factor = find_time_unit(unit);
    if (!factor) return refuse(text, fmt::format("unknown unit \"{:.20}\" (known: ns, us, ms, s)", unit));
    if (std::signbit(value) && value != 0.0) return refuse(text, "negative");
    const double seconds = std::abs(value) * *factor;
    if (seconds > kMaxBudgetSeconds) return refuse(text, "longer than an hour per step");
    return BudgetSpec{{BudgetMode::Wall, seconds, 0}};
}

std::string BudgetSpec::to_string() const {
    if (limits.mode == BudgetMode::Exact) return "exact";
    if (limits.mode == BudgetMode::Work) return fmt::format("work:{}", limits.work_units);
    if (limits.wall_s >= 1.0) return fmt::format("{:.6g}s", limits.wall_s);
    if (limits.wall_s >= 1e-3 || limits.wall_s == 0.0) return fmt::format("{:.6g}ms", limits.wall_s * 1e3);
    return fmt::format("{:.6g}us", limits.wall_s * 1e6);
}

} // namespace trocar::engine
