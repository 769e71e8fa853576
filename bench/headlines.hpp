// A bench in a few lines: the paper's or the peer's figure, what was measured here, the factor, and a sentence where the shape differs.
#pragma once

#include "bench/bench_table.hpp"

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct Headline {
    std::string what;
    std::string here;
    std::string beside;           // the paper's or the peer's figure; empty: none
    std::optional<double> factor; // theirs over ours: how many times less is needed here
    std::string remark;           // where the shape differs from theirs, and why; empty: it does not
};

/// Made of the table's rows alone. Rows that a quick run or a missing peer left out give no line.
[[nodiscard]] std::vector<Headline> headlines_of(std::string_view bench, const BenchTable& table);

/// Words as a cell of a Markdown table.
[[nodiscard]] std::string markdown_cell(const std::string& words);

struct BenchHeadlines {
    std::string bench;
    std::vector<Headline> lines;
};

/// All headlines as a table in Markdown, as docs/benchmarks.md shows it.
[[nodiscard]] std::string headlines_markdown(std::span<const BenchHeadlines> benches);
[[nodiscard]] std::string headlines_markdown(std::span<const MeasuredBench> measured);

} // namespace trocar::engine
