// Which rule carries the tissue over a sub-step.
#pragma once

#include <cstdint>

namespace trocar::fem {

enum class Integrator : std::uint8_t { Rk4, Leapfrog };

} // namespace trocar::fem
