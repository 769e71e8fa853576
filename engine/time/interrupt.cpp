#include "engine/time/interrupt.hpp"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <string_view>
#include <unistd.h>
#include <utility>

namespace trocar::engine {

namespace {

constexpr int kExitCode = 130; // of a program that SIGINT ended, as shells count

/// Set in a signal handler and read by any thread: the first asks for no lock, the second for an atomic.
std::atomic<bool> requested{false}, silent{false}, on_terminal{false};
std::atomic<int> holds{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

/// In a handler: nothing but write.
void say(std::string_view sentence) noexcept {
    if (silent.load(std::memory_order_relaxed)) return;
    constexpr std::string_view kClearLine = "\r\033[K"; // of the progress
    if (on_terminal.load(std::memory_order_relaxed) && write(STDERR_FILENO, kClearLine.data(), kClearLine.size()) < 0) return;
    if (write(STDERR_FILENO, sentence.data(), sentence.size()) < 0) return; // the reader has closed the stream
}

void request(int) {
    const int before = errno;
    if (requested.exchange(true)) _exit(kExitCode); // the first was answered and took too long
    if (holds.load() == 0) {
        say("interrupted: ended before it was done\n");
        _exit(kExitCode);
    }
    say("interrupted: ends as soon as it can; once more ends it at once\n");
    errno = before;
}

} // namespace

void catch_interrupts() {
    on_terminal.store(isatty(STDERR_FILENO) == 1);
    std::signal(SIGINT, request);
    std::signal(SIGTERM, request);
    if (std::signal(SIGHUP, request) == SIG_IGN) std::signal(SIGHUP, SIG_IGN); // under nohup a terminal that goes away means nothing
}

void answer_interrupts_silently() noexcept { silent.store(true); }

bool interrupt_requested() noexcept { return requested.load(std::memory_order_relaxed); }

InterruptHold::InterruptHold(Then then) noexcept : then_(then) { holds.fetch_add(1); }

InterruptHold::InterruptHold(InterruptHold&& other) noexcept : then_(other.then_), holds_(std::exchange(other.holds_, false)) {}

InterruptHold::~InterruptHold() {
    if (!holds_) return;
    const bool last = holds.fetch_sub(1) == 1; // a request after this ends the program by itself
    if (last && then_ == Then::End && requested.load()) _exit(kExitCode);
}

} // namespace trocar::engine
