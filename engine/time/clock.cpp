#include "engine/time/clock.hpp"

#include <ctime>

namespace trocar::engine {

namespace {

std::int64_t read(clockid_t clock) noexcept {
    timespec now{};
    clock_gettime(clock, &now);
    return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

} // namespace

std::int64_t monotonic_ns() noexcept { return read(CLOCK_MONOTONIC); }

std::int64_t thread_cpu_ns() noexcept { return read(CLOCK_THREAD_CPUTIME_ID); }

std::int64_t process_cpu_ns() noexcept { return read(CLOCK_PROCESS_CPUTIME_ID); }

void wait_until_ns(std::int64_t moment) noexcept {
    const timespec until{static_cast<std::time_t>(moment / 1'000'000'000), static_cast<long>(moment % 1'000'000'000)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr); // a signal ends it early
}

} // namespace trocar::engine
