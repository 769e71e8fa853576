// Where an instrument enters an imported vessel, what it may be driven to, and how thick it may be.
#pragma once

#include "base/inside.hpp"
#include "engine/importing/imported_vessel.hpp"

#include <string_view>

namespace trocar::engine {

/// Fills in entry, direction, targets and instrument from the branches and the ends.
/// device  of the catalogue; empty: a catheter is made for the way
/// fails   BadMesh: too narrow everywhere for any instrument, or for that device; BadUsage: no such device
[[nodiscard]] Result<void> fit_instrument(ImportedVessel& vessel, const InsideTest& inside, std::string_view device = {});

} // namespace trocar::engine
