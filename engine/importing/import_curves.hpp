// Centrelines of another program become a vessel: by the surface that comes with them, or by one that is swept along them.
#pragma once

#include "engine/importing/curve_set.hpp"
#include "engine/importing/import_vessel.hpp"

namespace trocar::engine {

[[nodiscard]] Result<ImportedVessel> import_curve_set(const CurveSet& curves, const VesselOptions& options,
                                                      const std::function<void(const std::string&)>& progress = {});

} // namespace trocar::engine
