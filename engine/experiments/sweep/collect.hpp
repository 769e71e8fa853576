// The table of a sweep, and where it stands.
#pragma once

#include "engine/experiments/sweep/result_store.hpp"

#include <functional>
#include <string>
#include <vector>

namespace trocar::engine {

/// What a table came to; its rows are passed on one by one, and not kept.
struct SweepTable {
    std::vector<std::string> columns;
    std::size_t varied = 0; // columns before "repeat"
    std::uint64_t rows = 0, done = 0, failed = 0, missing = 0;
    std::vector<std::string> notices; // collected names that no run has
};

[[nodiscard]] std::vector<std::string> column_names(const SweepPlan& plan);
/// Called with every row in the plan's order: the run's number, cells as text. An error ends the collection.
using RowSink = std::function<Result<void>(std::uint64_t, const std::vector<std::string>&)>;
/// memory  results of one chunk
/// fails   as the sink
[[nodiscard]] Result<SweepTable> collect_table(const std::filesystem::path& folder, const SweepPlan& plan, const RowSink& sink);
/// A line with its end.
[[nodiscard]] std::string csv_row(const std::vector<std::string>& cells);

struct SweepStatus {
    std::uint64_t runs = 0, done = 0, failed = 0, missing = 0, chunks = 0, complete_chunks = 0;
    std::vector<std::uint64_t> running; // the next missing run of every chunk that is worked on
    struct Failure {
        std::uint64_t run;
        std::string reason;
    };
    std::vector<Failure> failures;                   // at most kMostFailures
    std::vector<std::uint64_t> incomplete;           // chunks
    std::vector<std::pair<std::uint64_t, std::uint64_t>> missing_runs; // spans: first, last
    static constexpr std::size_t kMostFailures = 20;
};

[[nodiscard]] SweepStatus find_status(const std::filesystem::path& folder, const SweepPlan& plan);
[[nodiscard]] std::string status_text(const SweepStatus& status, const SweepPlan& plan);

} // namespace trocar::engine
