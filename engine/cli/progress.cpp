#include "engine/cli/progress.hpp"

#include <fmt/format.h>

#include <unistd.h>

#include <cstdio>

namespace trocar::engine {

namespace {
constexpr double kLogEvery = 60e3; // ms
}

ProgressLine::ProgressLine(bool wanted, Elsewhere elsewhere)
    : on_terminal_(wanted && isatty(STDERR_FILENO) == 1), logs_(wanted && !on_terminal_ && elsewhere == Elsewhere::ALineAMinute) {}

void ProgressLine::log(const std::string& text) {
    const double now = since_start_.elapsed_ms();
    if (!logs_ || now - last_log_ms_ < kLogEvery) return;
    last_log_ms_ = now;
    fmt::print(stderr, "{:.0f} s: {}\n", 1e-3 * now, text);
}

void ProgressLine::show(const std::string& text) {
    if (!on_terminal_) return log(text);
    fmt::print(stderr, "\r\033[K{:.110}", text);
    std::fflush(stderr);
    shown_ = true;
}

void ProgressLine::show_now_and_then(const std::string& text) {
    const double now = since_start_.elapsed_ms();
    if (!on_terminal_ || now - last_ms_ < 100.0) return;
    last_ms_ = now;
    show(text);
}

void ProgressLine::show_step(std::uint64_t done, std::uint64_t all, const StepReport& report) {
    const double now = since_start_.elapsed_ms();
    if (!on_terminal_ || (now - last_ms_ < 100.0 && done != all)) return;
    last_ms_ = now;
    show(fmt::format("step {}/{}  t {:.2f} s  {:.1f} ms (budget {:.2f})  inserted {:.0f} mm  {}{}", done, all, report.time_s,
                     report.ms.total, report.ms.budget, 1e3 * report.insertion_m, report.exact_ran ? "exact" : "coarse",
                     report.safe_fraction < 1.0 ? ", scaled" : ""));
}

void ProgressLine::clear() {
    if (shown_) fmt::print(stderr, "\r\033[K");
    shown_ = false;
}

} // namespace trocar::engine
