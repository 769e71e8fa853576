// How often this program has asked for memory: the step loop must not.
#pragma once

#include <cstddef>

namespace trocar::collision::testing {

[[nodiscard]] std::size_t allocation_count() noexcept;

} // namespace trocar::collision::testing
