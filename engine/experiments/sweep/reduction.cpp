#include "engine/experiments/sweep/reduction.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>

namespace trocar::engine {
namespace {

constexpr std::array<std::string_view, 13> kNames{"max", "min", "mean", "sum", "first", "last", "p1", "p5", "p50", "p90", "p95", "p99", "count"};

/// Nearest rank: a value that was measured.
double percentile(std::vector<double>& values, double share) {
    std::sort(values.begin(), values.end());
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
    return values[std::max<std::size_t>(rank, 1) - 1];
}

/// The next cell; its comma is taken as well.
std::string_view next_cell(std::string_view& line) {
    const std::size_t comma = line.find(',');
    const std::string_view cell = line.substr(0, comma);
    line.remove_prefix(comma == std::string_view::npos ? line.size() : comma + 1);
    return cell;
}

} // namespace

std::vector<std::string_view> reduction_names() { return {kNames.begin(), kNames.end()}; }

std::optional<double> reduce(std::string_view take, std::vector<double> values) {
    if (take == "count") return static_cast<double>(values.size());
    if (values.empty()) return std::nullopt;
    for (const double value : values)
        if (std::isnan(value)) return value; // comparisons would lose it
    if (take == "max") return *std::max_element(values.begin(), values.end());
    if (take == "min") return *std::min_element(values.begin(), values.end());
    if (take == "first") return values.front();
    if (take == "last") return values.back();
    const double sum = std::accumulate(values.begin(), values.end(), 0.0);
    if (take == "sum") return sum;
    if (take == "mean") return sum / static_cast<double>(values.size());
    int percent = 0;
    if (take.size() < 2 || take[0] != 'p' || std::from_chars(take.data() + 1, take.data() + take.size(), percent).ec != std::errc()) return std::nullopt;
    return percentile(values, 0.01 * percent);
}

std::optional<std::vector<double>> column_values(std::string_view csv, std::string_view column) {
    std::vector<double> values;
    std::optional<std::size_t> wanted;
    for (bool is_header = true; !csv.empty(); is_header = false) {
        const std::size_t end = csv.find('\n');
        std::string_view line = csv.substr(0, end);
        csv.remove_prefix(end == std::string_view::npos ? csv.size() : end + 1);
        for (std::size_t i = 0; !line.empty(); ++i) {
            const std::string_view cell = next_cell(line);
            if (is_header && cell == column) wanted = i;
            if (is_header || wanted != i) continue;
            double value = 0.0;
            const auto read = std::from_chars(cell.data(), cell.data() + cell.size(), value);
            if (read.ec != std::errc() || read.ptr != cell.data() + cell.size()) return std::nullopt;
            values.push_back(value);
        }
        if (is_header && !wanted) return std::nullopt;
    }
    if (!wanted) return std::nullopt;
    return values;
}

} // namespace trocar::engine
