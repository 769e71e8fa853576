// steps.csv: a row per step, on the disk soon after the step, under its own name only when the run has ended.
#pragma once

#include "base/result.hpp"
#include "engine/report/output_keys.hpp"
#include "engine/state/step_report.hpp"
#include "engine/time/clock.hpp"

#include <filesystem>
#include <string>

namespace trocar::engine {

/// Name, unit and meaning of every column, in their order.
[[nodiscard]] std::vector<OutputKey> step_table_columns();

/// "step,time_s,..." without a line end: the contract's columns, then more.
[[nodiscard]] std::string step_table_header();

/// Appends one row and its line end. Every number with as many digits as tell it from its neighbours.
/// budget_ms  limit of a step, infinity where the budget is no time
void append_step_row(const StepReport& report, double budget_ms, std::string& text);

/// Rows go to a partial file that is whole up to its last flush, so that a killed run can be read.
class StepTable {
public:
    [[nodiscard]] static Result<StepTable> create(const std::filesystem::path& folder, double budget_ms);
    StepTable(StepTable&& other) noexcept;
    StepTable& operator=(StepTable&&) = delete;
    ~StepTable();

    /// fails  CannotWrite: disk full. The rows wait and are tried again, as many as a bounded memory holds: a later call may write them all
    [[nodiscard]] Result<void> add(const StepReport& report);
    /// Flushes and gives the file its name.
    [[nodiscard]] Result<void> finish();

private:
    StepTable(std::filesystem::path folder, int file, double budget_ms);
    [[nodiscard]] Result<void> flush();

    std::filesystem::path folder_;
    int file_ = -1;
    int failed_ = 0;    // the system's reason; 0: all rows so far were taken
    bool lost_ = false; // more rows waited than the buffer holds
    double budget_ms_ = 0.0;
    std::string pending_;
    StopWatch since_flush_;
};

} // namespace trocar::engine
