// The papers' tables and the peers' figures, measured on this machine: one function per table, rows that say what was
// measured and what stands beside it. `trocar bench NAME --json FILE` prints and writes them.
#pragma once

#include "base/result.hpp"
#include "engine/report/gnuplot.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct BenchOptions {
    bool quick = false;                        // a small part of every table, for tests: same columns, fewer rows
    bool large = false;                        // the paper's large models as well, where a table has them
    unsigned threads = 0;                      // 0: one row set with 1 thread and one with every core
    std::filesystem::path json;                // empty: printed only
    std::filesystem::path page;                // empty: none; a page with the table and its plots
    std::filesystem::path scene;               // what scene-wide tables run; empty: the hepatic scene of this project
    std::optional<std::filesystem::path> data; // $TROCAR_TEST_DATA where it names a folder
    std::function<void(const std::string&)> progress = [](const std::string&) {}; // what is being measured now
};

/// One line of a table. Keys keep their order; units stand in the names (ns_per_tet, total_ms); a figure that was not
/// measured here (a paper's, a peer's that is not installed) says so in its own key or is null.
using BenchRow = nlohmann::ordered_json;

struct BenchTable {
    bool quick = false; // a small part: smaller models, fewer steps than the papers'
    std::vector<BenchRow> rows;
    std::vector<std::string> notes; // what was left out and why; printed under the table
    std::vector<Sketch> sketches;   // plots of the page
    std::vector<PlotData> plot_data;
};

struct Bench {
    std::string_view name;
    std::string_view what; // one line for --help
    Result<BenchTable> (*run)(const BenchOptions&);
};

/// The middle one of the values; 0 where there is none.
[[nodiscard]] inline double median(std::vector<double> values) {
    if (values.empty()) return 0.0;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

/// All benches, in the order in which they are listed.
[[nodiscard]] std::span<const Bench> benches();

/// The machine, as in every JSON file of a bench: cpu, cores, instruction sets, compiler, build type.
[[nodiscard]] nlohmann::ordered_json machine_json();

/// {"bench", "machine", "quick", "rows", "notes"}
[[nodiscard]] nlohmann::ordered_json bench_json(std::string_view name, const BenchTable& table);

/// A table that bench_json wrote, without its plots.
/// fails     no such file, no JSON, or not of a bench
struct ReadBench {
    std::string name;
    BenchTable table;
};
[[nodiscard]] Result<ReadBench> read_bench(const std::filesystem::path& file);

/// Rows as aligned text, a column per key that any row has.
[[nodiscard]] std::string bench_text(const BenchTable& table);

/// The table, its notes and plots as one page without any other file. Without gnuplot a sentence stands in place of the plots.
[[nodiscard]] std::string bench_page(const Bench& bench, const BenchTable& table);

/// A peer's program beside this one (peers/NAME in the folder of the running binary); empty where it was not built because
/// its package is missing.
[[nodiscard]] std::optional<std::filesystem::path> find_peer(std::string_view name);

} // namespace trocar::engine
