#include "bench/whole_steps/perf_counters.hpp"

#include <linux/perf_event.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace trocar::engine {

namespace {

int open_event(const PerfEvent& event, int leader) noexcept {
    perf_event_attr wanted{};
    wanted.size = sizeof wanted;
    wanted.type = event.type;
    wanted.config = event.config;
    wanted.read_format = PERF_FORMAT_GROUP;
    wanted.exclude_kernel = wanted.exclude_hv = 1;
    wanted.pinned = leader < 0; // all the time, or a read fails: no figure is scaled up from a part of the time
    return static_cast<int>(syscall(SYS_perf_event_open, &wanted, 0, -1, leader, PERF_FLAG_FD_CLOEXEC));
}

std::string explain_refusal(const PerfEvent& event, int error) {
    const std::string what = fmt::format("no counters, times alone: perf_event_open refused '{}'", event.name);
    if (error == ENOENT || error == EOPNOTSUPP || error == ENODEV)
        return fmt::format("{} ({}): this machine shows no such counter, as most virtual machines", what, std::strerror(error));
    if (error != EACCES && error != EPERM) return fmt::format("{} ({})", what, std::strerror(error));
    int paranoid = 0;
    std::ifstream("/proc/sys/kernel/perf_event_paranoid") >> paranoid;
    return fmt::format("{} ({}): kernel.perf_event_paranoid is {}, at most 2 lets a program count its own thread", what, std::strerror(error), paranoid);
}

} // namespace

std::span<const PerfEvent> hardware_events() noexcept {
    static constexpr PerfEvent kEvents[] = {{"instructions", PERF_TYPE_HARDWARE, PERF_COUNT_HW_INSTRUCTIONS},
                                            {"cycles", PERF_TYPE_HARDWARE, PERF_COUNT_HW_CPU_CYCLES},
                                            {"cache misses", PERF_TYPE_HARDWARE, PERF_COUNT_HW_CACHE_MISSES}};
    return kEvents;
}

PerfCounters::PerfCounters(std::span<const PerfEvent> events) {
    for (const PerfEvent& event : events.first(std::min(events.size(), kMostCounters))) {
        files_[count_] = open_event(event, count_ == 0 ? -1 : files_[0]);
        if (files_[count_] < 0) {
            refusal_ = explain_refusal(event, errno);
            return;
        }
        ++count_;
    }
}

PerfCounters::~PerfCounters() {
    for (const int file : files_)
        if (file >= 0) close(file);
}

CounterValues PerfCounters::read() const noexcept {
    std::array<std::uint64_t, 1 + kMostCounters> group{}; // how many, then each
    CounterValues values{};
    if (!counts()) return values;
    const auto size = static_cast<ssize_t>((1 + count_) * sizeof(std::uint64_t));
    if (::read(files_[0], group.data(), static_cast<std::size_t>(size)) != size) return values;
    for (std::size_t k = 0; k < count_; ++k) values[k] = group[1 + k];
    return values;
}

} // namespace trocar::engine
