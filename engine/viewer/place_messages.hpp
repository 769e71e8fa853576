// Text messages about places: those of the scene, once, with its message; those that are picked, when they are; a scene that was saved.
//   mark         {"name", "position" [m, at rest], "part", "vertex", "offset" [m]}: it goes with that vertex of that part; part null: with none
//   "vessel"     of the scene's message: {"part", "instrument", "entry": a mark with its "direction", "centreline"}; null: no instrument moves in one
//   "centreline" {"points": x, y, z of each [m, at rest], "parents": a point each, -1: the first; where the vessel moves "vertices" and
//                "offsets" as a mark has them, else null}
//   "picks"      {"target": a mark with "radius" [m], or null, "entry": the same with its "direction"}
//   "saved_scene" {"file", "command", "notices"}
#pragma once

#include "engine/prepare/prepare_scene.hpp"
#include "engine/viewer/picked_scene.hpp"

#include <nlohmann/json.hpp>

#include <string>

namespace trocar::engine::viewer {

/// A mark that goes with the nearest vertex of a vessel.
[[nodiscard]] nlohmann::ordered_json describe_mark(const Vec3& position, const std::string& name, const SceneModel& model);
/// The vessel that the first instrument moves in; places may be nullptr.
[[nodiscard]] nlohmann::ordered_json describe_vessel(const LumenPlaces* places, const SceneModel& model);

[[nodiscard]] std::string picks_message(const Picks& picks, const SceneModel& model);
[[nodiscard]] std::string saved_scene_message(const SavedScene& saved);

} // namespace trocar::engine::viewer
