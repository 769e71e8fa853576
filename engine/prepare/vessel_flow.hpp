// The flow of blood that several effects go by: drag on instruments, contrast agent.
#pragma once

#include "engine/prepare/effect_preparation.hpp"

#include <string>

namespace trocar::engine {

/// Blood in every vessel with an instrument that has none yet: from the scene's inlet where that lies in it, otherwise along the first
/// instrument's entry.
/// key       of the scene, for messages
/// speed     m/s, mean over the cross-section at the inlet
/// inlet     nullptr: none is given
Result<void> prepare_vessel_flow(const EffectPreparation& preparation, const std::string& key, double speed, const SceneTarget* inlet);

} // namespace trocar::engine
