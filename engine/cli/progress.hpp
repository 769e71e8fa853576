// One line on a terminal that tells how far a run is. Where standard error is no terminal: nothing, or a line a minute.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/time/clock.hpp"
#include "engine/time/limits.hpp"

#include <cstdint>
#include <string>

namespace trocar::engine {

class ProgressLine {
public:
    enum class Elsewhere : std::uint8_t { Silent, ALineAMinute }; // than on a terminal
    explicit ProgressLine(bool wanted, Elsewhere elsewhere = Elsewhere::Silent);
    void show(const std::string& text);
    /// At most ten times a second.
    void show_now_and_then(const std::string& text);
    /// At most ten times a second.
    void show_step(std::uint64_t done, std::uint64_t all, const StepReport& report, const BudgetLimits& budget);
    void clear();

private:
    void log(const std::string& text);

    bool on_terminal_, logs_;
    bool shown_ = false;
    StopWatch since_start_;
    double last_ms_ = -1e9, last_log_ms_ = 0.0;
    std::uint64_t first_step_ = 0; // that was shown; 0: none yet
    double first_step_ms_ = 0.0;
};

/// "  12 s left"; empty in the first second, when nothing can be told.
/// share  of the work that is done, 0..1
[[nodiscard]] std::string remaining_text(double elapsed_ms, double share);

} // namespace trocar::engine
