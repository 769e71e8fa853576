#include "engine/time/pacer.hpp"

#include <algorithm>

namespace trocar::engine {

Pacer::Pacer(const PaceSpec& pace, double step_s) noexcept : pace_(pace), interval_ns_(1e9 * step_s / pace.speed) {}

std::int64_t Pacer::begin_step(std::int64_t now_ns) noexcept {
    if (begun_ == 0) origin_ns_ = now_ns;
    const std::int64_t due = origin_ns_ + static_cast<std::int64_t>(interval_ns_ * static_cast<double>(begun_++));
    if (now_ns <= due) {
        stats_.waited_ns += due - now_ns;
        return due;
    }
    const std::int64_t late = now_ns - due;
    ++stats_.late_steps;
    stats_.worst_late_ns = std::max(stats_.worst_late_ns, late);
    if (pace_.late == LatePolicy::FallBehind) {
        stats_.lost_ns += late;
        origin_ns_ += late;
    }
    return now_ns;
}

} // namespace trocar::engine
