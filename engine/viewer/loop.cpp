#include "engine/viewer/loop.hpp"

#include "engine/fluoroscopy/patient.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace trocar::engine::viewer {

namespace {

/// ns between two polls of the commands while no step is due.
constexpr std::int64_t kIdleNap = 1'000'000;
/// ns over which the pace is measured.
constexpr std::int64_t kPaceWindow = 1'000'000'000;

double limit_ms(const BudgetLimits& limits) noexcept {
    return limits.mode == BudgetMode::Wall ? 1e3 * limits.wall_s : std::numeric_limits<double>::infinity();
}

/// Simulated against real time, over the last second or so.
class PaceMeter {
public:
    void add(double simulated_s, std::int64_t now) noexcept {
        if (since_ == 0) since_ = now;
        simulated_ += simulated_s;
        if (now - since_ < kPaceWindow) return;
        pace_ = simulated_ / (1e-9 * static_cast<double>(now - since_));
        since_ = now;
        simulated_ = 0.0;
    }
    void pause() noexcept { since_ = 0, simulated_ = 0.0; }
    [[nodiscard]] double pace() const noexcept { return pace_; }

private:
    std::int64_t since_ = 0;
    double simulated_ = 0.0, pace_ = 1.0;
};

class Loop {
public:
    Loop(Session& session, Exchange& exchange, const LoopOptions& options, RunStatistics& tally)
        : session_(session), exchange_(exchange), options_(options), tally_(tally), begun_(!options.wait_for_viewer) {}

    void run() {
        std::uint64_t taken = 0;
        while (!exchange_.stop.load(std::memory_order_relaxed) && (options_.steps == 0 || taken < options_.steps)) {
            const bool changed = take_commands();
            begun_ = begun_ || exchange_.viewers.load(std::memory_order_relaxed) > 0;
            if (!begun_ || !session_.wants_step()) {
                meter_.pause();
                due_ = 0;
                show(changed);
                show_xray(changed);
                wait_until_ns(monotonic_ns() + kIdleNap);
                continue;
            }
            if (!wait_until_due(changed)) continue;
            note(session_.step());
            ++taken;
            show(true);
            show_xray(true);
        }
    }

private:
    /// Of several restarts only the last is made, unless a state is saved between them: one takes as long as dozens of steps.
    bool take_commands() {
        const std::size_t count = exchange_.commands.pop(commands_.data(), commands_.size());
        const auto waiting = std::span(commands_).first(count);
        const auto is_restart = [](const Command& command) { return std::holds_alternative<Restart>(command); };
        const auto restart = std::find_if(waiting.rbegin(), waiting.rend(), is_restart).base(); // after it
        const bool keeps = std::any_of(waiting.begin(), waiting.end(), [](const Command& command) { return std::holds_alternative<SaveState>(command); });
        for (auto command = waiting.begin(); command != waiting.end(); ++command) {
            if (std::holds_alternative<Seal>(*command))
                seal(std::get<Seal>(*command));
            else if (!is_restart(*command) || command + 1 == restart || keeps)
                session_.apply(*command);
        }
        answer_due_ = answer_due_ || count > 0;
        return count > 0;
    }

    void seal(const Seal& asked) {
        Sealed sealed;
        if (const Saved* saved = session_.find_saved(asked.saved)) sealed.saved = *saved;
        sealed.recording = session_.recording();
        sealed.steps = sealed.recording ? sealed.recording->steps() : 0;
        sealed.state_hash = hash_state(session_.simulator().state());
        exchange_.sealed.push(sealed); // there is room: no more than kMostSeals are asked for
    }

    /// The next step begins when its simulated time has come, or at once where a command waits for what it does: then the
    /// simulation is ahead of the clock, by one step at most, until the time of the step after it has come. Steps that are late are not
    /// caught up with: the run is then slower than the clock, and reports it. False: a while has passed, read the commands first.
    bool wait_until_due(bool commanded) {
        if (!options_.paced) return true;
        const std::int64_t now = monotonic_ns();
        const auto interval = static_cast<std::int64_t>(1e9 * session_.model().step_s / session_.status().pace);
        if (due_ == 0 || now - due_ > interval || due_ - now > 2 * interval) due_ = now;
        const bool ahead = due_ - now > interval;
        if (due_ > now && (!commanded || ahead)) {
            wait_until_ns(std::min(due_, now + kIdleNap));
            if (monotonic_ns() < due_) return false;
        }
        due_ += interval;
        return true;
    }

    void note(const StepReport& report) {
        const double limit = limit_ms(session_.status().budget);
        meter_.add(session_.model().step_s, monotonic_ns());
        if (tally_.steps < kTallySteps) tally_.add(report, limit, session_.simulator().contacts().size());
        const PlotPoint point{report.step,
                              static_cast<float>(report.ms.total),
                              static_cast<float>(report.ms.budget),
                              std::isfinite(limit) ? static_cast<float>(limit) : 0.0f,
                              static_cast<std::int16_t>(report.level_reached),
                              report.budget_kept,
                              static_cast<float>(report.contact_force_n),
                              static_cast<float>(report.insertion_m)};
        if (exchange_.viewers.load(std::memory_order_relaxed) > 0 && !exchange_.steps.push(point))
            exchange_.steps_not_shown.fetch_add(1, std::memory_order_relaxed);
    }

    /// Copies only what a viewer will show: the last one has been taken. What is skipped is shown later, but for what answers a
    /// command, or a viewer that has come: that takes the place of an older one, which no viewer has shown yet, and the user sees the
    /// effect a frame earlier.
    void show(bool changed) {
        behind_ = behind_ || changed;
        const std::uint64_t joined = exchange_.joined.load(std::memory_order_acquire);
        if (std::exchange(joined_, joined) != joined) behind_ = answer_due_ = true;
        if (!behind_ || exchange_.viewers.load(std::memory_order_relaxed) == 0) return;
        if (!exchange_.snapshot.taken() && !answer_due_) return;
        const bool answers = std::exchange(answer_due_, false);
        Snapshot& snapshot = exchange_.snapshot.back();
        fill_snapshot(session_, exchange_.spheres.load(std::memory_order_relaxed), snapshot);
        snapshot.pace = meter_.pace();
        exchange_.snapshot.publish();
        if (answers) exchange_.answers.fetch_add(1, std::memory_order_release);
        behind_ = false;
    }

    /// The same for the X-ray monitor, which takes the next one when it is ready.
    void show_xray(bool changed) {
        xray_behind_ = xray_behind_ || changed;
        const bool wanted = exchange_.xray_wanted.load(std::memory_order_relaxed);
        const bool was_wanted = std::exchange(xray_wanted_, wanted), anew = wanted && !was_wanted; // what was published before is old
        if (!wanted || (!anew && (!xray_behind_ || !exchange_.xray.taken()))) return;
        update_visible_part(session_.model(), session_.simulator().state(), exchange_.xray.back());
        exchange_.xray.publish();
        xray_behind_ = false;
    }

    Session& session_;
    Exchange& exchange_;
    const LoopOptions& options_;
    RunStatistics& tally_;
    PaceMeter meter_;
    std::array<Command, kMostCommands> commands_;
    std::int64_t due_ = 0;
    bool begun_;              // steps may be taken
    bool behind_ = true;      // the published snapshot is out of date
    bool xray_behind_ = true; // likewise the monitor's
    bool xray_wanted_ = false;
    bool answer_due_ = false; // a command was applied, or a viewer has come, after that
    std::uint64_t joined_ = 0; // viewers that had come until then
};

} // namespace

void open_exchange(Session& session, Exchange& exchange) {
    for (Snapshot& place : exchange.snapshot.places()) prepare_snapshot(session, place);
    fill_snapshot(session, false, exchange.snapshot.back());
    exchange.snapshot.publish();
    exchange.xray.places().fill(visible_part(session.simulator().state()));
}

void run_loop(Session& session, Exchange& exchange, const LoopOptions& options, RunStatistics& tally) {
    tally.reserve(options.steps > 0 ? std::min(options.steps, kTallySteps) : kTallySteps);
    Loop(session, exchange, options, tally).run();
}

} // namespace trocar::engine::viewer
