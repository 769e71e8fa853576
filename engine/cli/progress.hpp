// One line on a terminal that tells how far a run is; nothing where standard error is no terminal.
#pragma once

#include "engine/step/report.hpp"
#include "engine/time/clock.hpp"

#include <string>

namespace seldinger::engine {

class ProgressLine {
public:
    explicit ProgressLine(bool wanted);
    void show(const std::string& text);
    /// At most ten times a second.
    void show_now_and_then(const std::string& text);
    /// At most ten times a second.
    void show_step(std::uint64_t done, std::uint64_t all, const StepReport& report);
    void clear();

private:
    bool on_terminal_;
    bool shown_ = false;
    StopWatch since_start_;
    double last_ms_ = -1e9;
};

} // namespace seldinger::engine
