// What an instrument is made of: cross-section, shape of the tip, stiffness and coating along it. Of a scene, or of the device that the
// instrument begins as.
#pragma once

#include "engine/scene/reader.hpp"

namespace trocar::engine {

/// Fills the instrument with what the device of its key "device" says; its name stays.
[[nodiscard]] std::optional<Error> begin_as_device(const CheckContext& context, const Values& values, SceneInstrument& instrument);

/// The keys that are present, over what the instrument has already, and what they leave open; inner radius and layers are still to be
/// turned into a section by complete_section.
[[nodiscard]] std::optional<Error> read_design(const Reading& reading, SceneInstrument& instrument);

/// The solid circular section that bends and weighs as the tube does, and by how much the tube differs from it otherwise. Once, at the end.
void complete_section(SceneInstrument& instrument);

} // namespace trocar::engine
