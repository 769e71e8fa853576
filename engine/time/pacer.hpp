// How simulated time goes against wall time, and what happens to a run that cannot keep up: declared beforehand, counted, never silent.
// No step reads it: the same steps give the same bits at any pace.
#pragma once

#include "engine/time/limits.hpp"

#include <cstdint>

namespace trocar::engine {

struct PaceStats {
    std::uint64_t late_steps = 0;
    std::int64_t worst_late_ns = 0; // of one step's beginning
    std::int64_t lost_ns = 0;       // by which the run has fallen behind real time
    std::int64_t waited_ns = 0;     // for steps to be due
};

class Pacer {
public:
    Pacer(const PaceSpec& pace, double step_s) noexcept;
    /// Before every step: the moment at which it begins, now or later.
    [[nodiscard]] std::int64_t begin_step(std::int64_t now_ns) noexcept;
    [[nodiscard]] const PaceSpec& spec() const noexcept { return pace_; }
    [[nodiscard]] const PaceStats& stats() const noexcept { return stats_; }

private:
    PaceSpec pace_;
    double interval_ns_; // between steps
    PaceStats stats_;
    std::uint64_t begun_ = 0;
    std::int64_t origin_ns_ = 0; // when step `begun_` 0 was due
};

} // namespace trocar::engine
