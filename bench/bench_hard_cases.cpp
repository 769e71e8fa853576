// The table of all hard cases: what is measured beside its bound, and by how much it holds.
#include "bench/hard_cases.hpp"
#include "bench/hard_long_runs.hpp"
#include "bench/tables.hpp"

#include <cmath>

namespace trocar::engine {

namespace {

/// How many times farther it could go: 1 is at the bound, below 1 beyond it; null where the bound is zero or exact.
BenchRow factor_of(const HardMargin& m) {
    if (m.relation == '=' || m.bound == 0.0 || m.measured == 0.0 || !std::isfinite(m.measured)) return nullptr;
    const double factor = m.relation == '<' ? m.bound / m.measured : m.measured / m.bound;
    return factor > 0.0 ? BenchRow(factor) : BenchRow(nullptr);
}

void add_rows(const HardCase& hard, BenchTable& table) {
    HardReport report;
    hard.run(report);
    const auto add = [&](const std::string& what) -> BenchRow& {
        BenchRow& row = table.rows.emplace_back();
        row["group"] = hard.group;
        row["case"] = hard.name;
        row["what"] = what;
        return row;
    };
    for (const HardMargin& m : report.margins()) {
        BenchRow& row = add(m.what);
        row["measured"] = m.measured;
        row["relation"] = std::string(1, m.relation);
        row["bound"] = m.bound;
        row["unit"] = m.unit;
        row["margin"] = factor_of(m);
        row["holds"] = m.holds();
    }
    for (const std::string& sentence : report.broken()) add(sentence)["holds"] = false;
    if (report.margins().empty() && report.broken().empty()) add(std::string(hard.stable))["holds"] = true;
    for (const std::string& note : report.notes()) table.notes.push_back(fmt::format("{}: {}", hard.name, note));
}

} // namespace

std::vector<HardCase> hard_cases() {
    std::vector<HardCase> all;
    for (const auto& group : {hard_elements(), hard_steps(), hard_sweeps(), hard_contacts(), hard_presses(), hard_slopes(), hard_places(),
                              hard_tunnels(), hard_instruments(), hard_runs()})
        all.insert(all.end(), group.begin(), group.end());
    return all;
}

Result<BenchTable> bench_hard_cases(const BenchOptions& options) {
    BenchTable table;
    for (const HardCase& hard : hard_cases()) {
        if (options.quick && hard.group != "sweeps") continue;
        options.progress(std::string(hard.name));
        add_rows(hard, table);
    }
    std::size_t broken = 0;
    for (const BenchRow& row : table.rows) broken += !row["holds"].get<bool>();
    table.notes.push_back(fmt::format("{} figures, {} beyond their bound", table.rows.size(), broken));
    if (options.large)
        if (const Result<void> done = add_long_runs(options, table); !done.ok()) return done.error();
    return table;
}

} // namespace trocar::engine
