// How simulated time goes against wall time, and what happens to a run that cannot keep up: declared beforehand, counted, never silent.
// No step looks at it: the same steps come to the same bits at any pace.
#pragma once

#include <cstdint>

namespace trocar::engine {

/// A step that begins after its time.
enum class LatePolicy : std::uint8_t {
    SlowMotion, // the clock of the run stands still for as long: what was lost is not made up for
    CatchUp,    // the next steps begin one after another until the run is where it should be
};

struct PaceSpec {
    double speed = 1.0; // simulated seconds in a second, > 0
    LatePolicy late = LatePolicy::SlowMotion;
};

struct PaceStats {
    std::uint64_t late_steps = 0;
    std::int64_t worst_late_ns = 0; // of one step's beginning
    std::int64_t lost_ns = 0;       // by which slow motion has put the run behind the clock
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
