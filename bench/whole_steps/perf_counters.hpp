// Hardware counters of this thread where the kernel gives them: one group of perf events, read by one system call.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace trocar::engine {

/// As perf_event_open(2) names it.
struct PerfEvent {
    const char* name;
    std::uint32_t type;
    std::uint64_t config;
};

inline constexpr std::size_t kMostCounters = 4;
using CounterValues = std::array<std::uint64_t, kMostCounters>; // in the order of the events; of those that there are not, 0

/// Instructions, cycles, misses of the last cache.
[[nodiscard]] std::span<const PerfEvent> hardware_events() noexcept;

class PerfCounters {
public:
    /// events   at most kMostCounters; all of them or none are counted, of this thread in user mode
    explicit PerfCounters(std::span<const PerfEvent> events);
    ~PerfCounters();
    PerfCounters(const PerfCounters&) = delete;
    PerfCounters& operator=(const PerfCounters&) = delete;

    [[nodiscard]] bool counts() const noexcept { return refusal_.empty(); }
    /// Why nothing is counted, a sentence; empty: it is.
    [[nodiscard]] const std::string& refusal() const noexcept { return refusal_; }
    /// Since construction; zeros where nothing is counted. cost: about a microsecond
    [[nodiscard]] CounterValues read() const noexcept;

private:
    std::array<int, kMostCounters> files_{-1, -1, -1, -1}; // the first leads the group
    std::size_t count_ = 0;
    std::string refusal_;
};

} // namespace trocar::engine
