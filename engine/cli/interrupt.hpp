// Ctrl-C and a polite kill: the command stops at the next step and writes what it has.
#pragma once

namespace seldinger::engine {

void catch_interrupts();
[[nodiscard]] bool interrupt_requested() noexcept;

} // namespace seldinger::engine
