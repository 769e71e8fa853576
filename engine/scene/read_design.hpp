// What an instrument is made of: cross-section, shape of the tip, stiffness and coating along it. Of a scene, or of the device that the
// instrument begins as.
#pragma once

#include "engine/scene/reader.hpp"

namespace trocar::engine {

/// Fills the instrument with what the device of its key "device" says; its name stays.
[[nodiscard]] std::optional<Error> begin_as_device(const CheckContext& context, const Values& values, SceneInstrument& instrument);

/// The keys that are present, over what the instrument has already, and what they leave open.
[[nodiscard]] std::optional<Error> read_design(const Reading& reading, SceneInstrument& instrument);

} // namespace trocar::engine
