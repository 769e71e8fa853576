// docs/benchmarks.md: its tables are made of what benches measured, each with its command, date, commit and machine.
#pragma once

#include "bench/bench_table.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace trocar::engine {

/// What the page shows of a bench that was measured by this program, here and today, into DOCS/measured/NAME.json, instead of what stood there:
/// {"bench", "version", "commit", "date", "machine", "command", "headlines": [{"what", "here", "beside", "factor", "remark"}], "rows"}
/// rows: of the bench literature alone.
/// fails  BadUsage: a quick table is no figure to show; as write_file_atomically
[[nodiscard]] Result<void> keep_measured(const std::filesystem::path& docs, std::string_view name, const BenchTable& table);

/// DOCS/benchmarks.md as it becomes: between `<!-- NAME: written by trocar bench --docs -->` and `<!-- end of NAME -->` the table NAME (headlines,
/// runs or literature) of what DOCS/measured holds, all else as it stands.
/// fails  no page, marks that do not pair, a file that is not what keep_measured writes or cannot be read
[[nodiscard]] Result<std::string> make_benchmark_page(const std::filesystem::path& docs);

/// Into its place.
/// fails  as that and write_file_atomically, and where DOCS/measured holds nothing; nothing is written then
[[nodiscard]] Result<void> write_benchmark_page(const std::filesystem::path& docs);

} // namespace trocar::engine
