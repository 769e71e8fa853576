// What several effects say or ask of a scene and a model.
#pragma once

#include "engine/prepare/model.hpp"
#include "engine/scene/effect.hpp"
#include "engine/scene/scene.hpp"

#include <algorithm>

namespace trocar::engine::effects {

[[nodiscard]] inline std::string listed(bool on, std::string why) {
    return on ? std::move(why) : std::string("not among the scene's effects");
}

template <class Has>
[[nodiscard]] bool any_body(const SceneModel& model, Has has) {
    return std::any_of(model.bodies.begin(), model.bodies.end(), has);
}

[[nodiscard]] inline bool deforms(const BodyModel& body) noexcept { return body.tissue.has_value(); }

inline constexpr const char* kNothingDeforms = "no body deforms";
inline constexpr const char* kNoInstrument = "no instrument";

} // namespace trocar::engine::effects
