#include "engine/cli/progress.hpp"

#include "engine/cli/commands.hpp"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
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
    print_to_stderr(fmt::format("{:.0f} s: {}", 1e-3 * now, text));
}

void ProgressLine::show(const std::string& text) {
    if (!on_terminal_) return log(text);
    std::fputs(fmt::format("\r\033[K{:.110}", text).c_str(), stderr);
    std::fflush(stderr);
    shown_ = true;
}

void ProgressLine::show_now_and_then(const std::string& text) {
    const double now = since_start_.elapsed_ms();
    if (!on_terminal_ || now - last_ms_ < 100.0) return;
    last_ms_ = now;
    show(text);
}

std::string remaining_text(double elapsed_ms, double share) {
    if (!(share > 0.0) || elapsed_ms < 1000.0) return {};
    const double left_s = 1e-3 * elapsed_ms * (1.0 - std::min(share, 1.0)) / share;
    if (left_s < 90.0) return fmt::format("  {:.0f} s left", left_s);
    return left_s < 5400.0 ? fmt::format("  {:.0f} min left", left_s / 60.0) : fmt::format("  {:.1f} h left", left_s / 3600.0);
}

void ProgressLine::show_step(std::uint64_t done, std::uint64_t all, const StepReport& report, const BudgetLimits& budget) {
    const double now = since_start_.elapsed_ms();
    if (first_step_ == 0) {
        first_step_ = done;
        first_step_ms_ = now;
    }
    if (!on_terminal_ || (now - last_ms_ < 100.0 && done != all)) return;
    last_ms_ = now;
    const std::string limit = budget.mode == BudgetMode::Wall ? fmt::format("budget {:.2f} of {:.4g} ms", report.ms.budget, 1e3 * budget.wall_s)
                                                              : fmt::format("contact {:.2f} ms", report.ms.budget);
    const double share = all > first_step_ ? static_cast<double>(done - first_step_) / static_cast<double>(all - first_step_) : 1.0;
    const std::string inserted = report.insertion_m > 0.0 ? fmt::format("inserted {:.0f} mm  ", 1e3 * report.insertion_m) : std::string();
    show(fmt::format("step {} of {}  t {:.2f} s  took {:.1f} ms  {}  {}{}{}{}", done, all, report.time_s, report.ms.total, limit, inserted,
                     report.exact_ran ? "exact" : "coarse", report.safe_fraction < 1.0 ? ", scaled" : "",
                     done < all ? remaining_text(now - first_step_ms_, share) : ""));
}

void ProgressLine::clear() {
    if (shown_) std::fputs("\r\033[K", stderr);
    shown_ = false;
}

} // namespace trocar::engine
