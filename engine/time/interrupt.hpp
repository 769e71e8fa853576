// Ctrl-C and a polite kill: the program ends at once with a sentence and exit code 130, unless some owner has output to finish
// first. That owner holds the interruption; then the first request sets a flag that it polls, and the second ends the program at once.
#pragma once

#include <cstdint>

namespace trocar::engine {

/// From here on requests are answered as above. A library that never calls this leaves the signals alone.
void catch_interrupts();

/// The same without messages: for a process whose parent prints them.
void answer_interrupts_silently() noexcept;

/// A request came while the interruption was held.
[[nodiscard]] bool interrupt_requested() noexcept;

/// While one lives a request does not end the program.
class InterruptHold {
public:
    /// Once the last hold has gone, after a request: the program ends (nothing else polls the flag), or its owner handles it.
    enum class Then : std::uint8_t { End, OwnerEnds };
    explicit InterruptHold(Then then) noexcept;
    InterruptHold(InterruptHold&& other) noexcept;
    InterruptHold& operator=(InterruptHold&&) = delete;
    ~InterruptHold();

private:
    Then then_;
    bool holds_ = true;
};

} // namespace trocar::engine
