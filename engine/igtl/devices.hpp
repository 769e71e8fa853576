// Names of what is sent and taken: the scene's, as far as 20 bytes hold them.
#pragma once

#include "engine/prepare/model.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine::igtl {

inline const std::string kProgramDevice = "trocar"; // its STATUS
inline const std::string kStateDevice = "trocar_state", kSceneDevice = "trocar_scene", kCommandDevice = "trocar_command";

struct InstrumentDevices {
    std::string skin, tip, drive; // NAME, NAME_tip, NAME_drive
};

/// No two are the same: a name that is too long is cut, one that is taken gets a number.
struct Devices {
    std::vector<std::string> bodies;
    std::vector<InstrumentDevices> instruments;
};
[[nodiscard]] Devices name_devices(const SceneModel& model);

/// Who is who, as JSON: trocar_scene.
[[nodiscard]] std::string describe_scene(const std::string& scene, const SceneModel& model, const Devices& devices);

} // namespace trocar::engine::igtl
