// The calendar: for what is kept beside measured figures, never for a step.
#pragma once

#include <string>

namespace trocar::engine {

/// "2026-11-27", in UTC.
[[nodiscard]] std::string today();

} // namespace trocar::engine
