// Where an instrument enters an imported vessel, what it may be driven to, and how thick it may be.
#pragma once

#include "base/inside.hpp"
#include "engine/importing/imported_vessel.hpp"

namespace trocar::engine {

/// Fills in entry, direction, targets and instrument from the branches and the ends.
/// fails  BadMesh: too narrow everywhere for any instrument
[[nodiscard]] Result<void> fit_instrument(ImportedVessel& vessel, const InsideTest& inside);

} // namespace trocar::engine
