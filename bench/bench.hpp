// The papers' tables and the peers' figures, measured on this machine: one function per table, rows that say what was
// measured and what stands beside it. `trocar bench NAME --json FILE` prints and writes them.
#pragma once

#include "bench/bench_table.hpp"

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace trocar::engine {

/// All benches, in the order in which they are listed.
[[nodiscard]] std::span<const Bench> benches();

/// The machine, as in every JSON file of a bench: cpu, cores, instruction sets, compiler, build type.
[[nodiscard]] nlohmann::ordered_json machine_json();

/// "trocar bench NAME" with the options that decide what is measured.
[[nodiscard]] std::string bench_command(std::string_view name, const BenchOptions& options);

/// {"bench", "version", "commit", "machine", "command", "scenes", "quick", "rows", "notes"}
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

/// All headlines and all tables, with their plots, as one page without any other file.
[[nodiscard]] std::string all_benches_page(std::span<const MeasuredBench> measured);

/// A peer's program beside this one (peers/NAME in the folder of the running binary); empty where it was not built because
/// its package is missing.
[[nodiscard]] std::optional<std::filesystem::path> find_peer(std::string_view name);

} // namespace trocar::engine
