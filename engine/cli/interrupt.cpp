#include "engine/cli/interrupt.hpp"

#include <atomic>
#include <csignal>

namespace seldinger::engine {

namespace {

/// Set in a signal handler and read by any thread: the first asks for no lock, the second for an atomic.
std::atomic<bool> requested{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void request(int) { requested.store(true, std::memory_order_relaxed); }

} // namespace

void catch_interrupts() {
    std::signal(SIGINT, request);
    std::signal(SIGTERM, request);
    if (std::signal(SIGHUP, request) == SIG_IGN) std::signal(SIGHUP, SIG_IGN); // under nohup a terminal that goes away means nothing
}

bool interrupt_requested() noexcept { return requested.load(std::memory_order_relaxed); }

} // namespace seldinger::engine
