#include "engine/prepare/body_pairs.hpp"

#include <algorithm>

namespace trocar::engine {

std::size_t owner_of(const SceneModel& model, std::size_t body) noexcept {
    return model.bodies[body].host_body.value_or(body);
}

bool are_nested(const SceneModel& model, std::size_t i, std::size_t j) noexcept {
    return std::binary_search(model.nested.begin(), model.nested.end(), std::pair(std::min(i, j), std::max(i, j)));
}

bool are_solid_pair(const SceneModel& model, std::size_t i, std::size_t j) noexcept {
    const BodyModel& a = model.bodies[i];
    const BodyModel& b = model.bodies[j];
    const auto gives = [&](std::size_t body) { return model.bodies[owner_of(model, body)].tissue.has_value(); };
    if (a.hollow || b.hollow || !(gives(i) || gives(j)) || are_nested(model, i, j)) return false;
    return a.host_body != j && b.host_body != i;
}

bool can_touch_any(const SceneModel& model, std::size_t body) noexcept {
    for (std::size_t other = 0; other < model.bodies.size(); ++other)
        if (other != body && (are_solid_pair(model, body, other) || are_nested(model, body, other))) return true;
    return touches_itself(model, body);
}

std::size_t reserved_places(const BodyModel& body) noexcept {
    constexpr std::size_t kCrossings = 4;
    return body.surface.vertices.size() + kCrossings * body.sharp_edges.size();
}

bool are_all_free(const SceneModel& model) noexcept {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!can_touch_any(model, i)) continue;
        const std::optional<fem::TissueModel>& tissue = model.bodies[owner_of(model, i)].tissue;
        if (!tissue || !tissue->pinned.empty()) return false;
    }
    return true;
}

bool touches_itself(const SceneModel& model, std::size_t body) noexcept {
    const BodyModel& own = model.bodies[body];
    return model.effects.self_contact && own.self_contact && own.links && !own.hollow;
}

bool meet_by_surface(const SceneModel& model, std::size_t a, std::size_t b) noexcept {
    if (model.contact.solid_response != SolidResponse::Surface) return false;
    if (a == b && touches_itself(model, a)) return true;
    return model.bodies[a].closed && model.bodies[b].closed;
}

} // namespace trocar::engine
