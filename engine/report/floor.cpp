#include "engine/report/floor.hpp"

#include "engine/time/clock.hpp"

#include <algorithm>
#include <vector>

namespace trocar::engine {

namespace {

double middle(std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

} // namespace

std::optional<Floor> measure_floor(const Simulator& like, const State* from, std::uint64_t steps, double most_ms) {
    Simulator simulator(like, BudgetLimits{BudgetMode::Work, 0.0, 0});
    if (from != nullptr && !simulator.restore(*from).ok()) return std::nullopt;
    std::vector<double> charged;
    std::array<std::vector<double>, kAccountParts> parts;
    const StopWatch watch;
    if (!simulator.step().finite) return std::nullopt; // the first finds its memory
    while (charged.size() < steps && (charged.empty() || watch.elapsed_ms() < most_ms)) {
        const StepReport& report = simulator.step();
        if (!report.finite) break;
        charged.push_back(report.ms.budget);
        for (std::size_t k = 0; k < kAccountParts; ++k) parts[k].push_back(report.account[k].used_ms);
    }
    if (charged.empty()) return std::nullopt;
    Floor floor;
    floor.steps = charged.size();
    floor.ms = middle(charged);
    for (std::size_t k = 0; k < kAccountParts; ++k) floor.part_ms[k] = middle(parts[k]);
    return floor;
}

} // namespace trocar::engine
