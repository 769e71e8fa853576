// Stages of every step on a time line, for chrome://tracing and ui.perfetto.dev.
#pragma once

#include "engine/state/step_report.hpp"

#include <string>

namespace trocar::engine {

/// Trace events, gathered step by step. What lies between two steps (pictures, records) is left out: the steps follow one
/// another.
class StepTrace {
public:
    void add(const StepReport& report);
    /// JSON, complete.
    [[nodiscard]] std::string text() const;

private:
    void add_span(const char* name, double begin_ms, double length_ms, int row);
    std::string events_;
    double now_ms_ = 0.0;
};

} // namespace trocar::engine
