#include "engine/importing/import_curves.hpp"

#include "engine/importing/sweep_curves.hpp"

namespace trocar::engine {

Result<ImportedVessel> import_curve_set(const CurveSet& curves, const VesselOptions& options,
                                        const std::function<void(const std::string&)>& progress) {
    if (curves.surface) return import_vessel(*curves.surface, options, progress);
    if (progress) progress("sweeping a surface along the curves");
    Result<SweptSurface> swept = sweep_curves(curves.curves);
    if (!swept.ok()) return swept.error();
    Result<ImportedVessel> vessel = import_vessel(std::move(swept->mesh), options, progress);
    if (vessel.ok()) vessel->repairs.insert(vessel->repairs.begin(), swept->told.begin(), swept->told.end());
    return vessel;
}

} // namespace trocar::engine
