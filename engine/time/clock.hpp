// The only reader of a clock. Everything below counts work instead.
#pragma once

#include <cstdint>

namespace trocar::engine {

/// Nanoseconds of a monotonic clock; only differences mean something.
[[nodiscard]] std::int64_t monotonic_ns() noexcept;

/// Nanoseconds that this thread has run: what the operating system gave to others does not count.
[[nodiscard]] std::int64_t thread_cpu_ns() noexcept;

/// The same of all threads of the process.
[[nodiscard]] std::int64_t process_cpu_ns() noexcept;

/// Sleeps until monotonic_ns() is at least this; a moment that has passed does not wait.
void wait_until_ns(std::int64_t moment) noexcept;

/// Where the budget reads the time; tests substitute their own clock.
class Clock {
public:
    virtual ~Clock() = default;
    [[nodiscard]] virtual std::int64_t now_ns() const noexcept = 0;
    /// What this thread has run; a clock that cannot tell gives its time.
    [[nodiscard]] virtual std::int64_t cpu_ns() const noexcept { return now_ns(); }
};

class MonotonicClock final : public Clock {
public:
    [[nodiscard]] std::int64_t now_ns() const noexcept override { return monotonic_ns(); }
    [[nodiscard]] std::int64_t cpu_ns() const noexcept override { return thread_cpu_ns(); }
};

/// Milliseconds since construction or the last lap.
class StopWatch {
public:
    StopWatch() noexcept : start_(monotonic_ns()) {}
    [[nodiscard]] double lap_ms() noexcept {
        const std::int64_t now = monotonic_ns();
        const double ms = static_cast<double>(now - start_) * 1e-6;
        start_ = now;
        return ms;
    }
    [[nodiscard]] double elapsed_ms() const noexcept { return static_cast<double>(monotonic_ns() - start_) * 1e-6; }

private:
    std::int64_t start_;
};

} // namespace trocar::engine
