// Which bodies can touch, and whose nodes carry whose surface: facts of the model.
#pragma once

#include "engine/prepare/model.hpp"

namespace trocar::engine {

/// The body in whose coarse mesh this one is embedded: itself, or its host.
[[nodiscard]] std::size_t owner_of(const SceneModel& model, std::size_t body) noexcept;

/// Does one of them start wholly inside the other? See SceneModel::nested.
[[nodiscard]] bool are_nested(const SceneModel& model, std::size_t i, std::size_t j) noexcept;

/// Can these two bodies touch? Both are solid, one gives way (what two scripts do to each other is theirs), neither carries the other (those are one body), and neither starts inside the
/// other.
[[nodiscard]] bool are_solid_pair(const SceneModel& model, std::size_t i, std::size_t j) noexcept;

/// Is there anything that this body can touch, itself included?
[[nodiscard]] bool can_touch_any(const SceneModel& model, std::size_t body) noexcept;

/// Places of its surface that lists of contact are reserved for: its vertices, and some crossings of each sharp edge.
[[nodiscard]] std::size_t reserved_places(const BodyModel& body) noexcept;

/// No solid that something can touch stands still, is held, or is moved by a script.
[[nodiscard]] bool are_all_free(const SceneModel& model) noexcept;

/// The scene has the effect, and the body's surface deforms with coarse nodes.
[[nodiscard]] bool touches_itself(const SceneModel& model, std::size_t body) noexcept;

/// The scene's response is "surface", and both bodies are closed: depths beneath their leaves are those of the surfaces. A body against
/// itself need not be closed: its triangles say which side is out.
[[nodiscard]] bool meet_by_surface(const SceneModel& model, std::size_t a, std::size_t b) noexcept;

} // namespace trocar::engine
