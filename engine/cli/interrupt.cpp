#include "engine/cli/interrupt.hpp"

#include <csignal>

namespace seldinger::engine {

namespace {

volatile std::sig_atomic_t requested = 0;

void request(int) { requested = 1; }

} // namespace

void catch_interrupts() {
    std::signal(SIGINT, request);
    std::signal(SIGTERM, request);
    if (std::signal(SIGHUP, request) == SIG_IGN) std::signal(SIGHUP, SIG_IGN); // under nohup a terminal that goes away means nothing
}

bool interrupt_requested() noexcept { return requested != 0; }

} // namespace seldinger::engine
