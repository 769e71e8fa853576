// Ctrl-C and a polite kill: the program ends at once with a sentence and exit code 130, unless somebody has something to put away
// first. Who does holds the interruption; then the first request is a flag to look at, and the second ends the program at once.
#pragma once

#include <cstdint>

namespace trocar::engine {

/// From here on requests are answered as above. A library that never calls this leaves the signals alone.
void catch_interrupts();

/// The answers without words: for a process whose parent has said it.
void answer_interrupts_silently() noexcept;

/// A request came while somebody held the interruption.
[[nodiscard]] bool interrupt_requested() noexcept;

/// While one lives a request does not end the program.
class InterruptHold {
public:
    /// Once the last hold has gone, after a request: the program ends (nobody else would look), or its owner sees to it.
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
