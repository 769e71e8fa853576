// What a contact's id stands for. Detection knows bodies and instruments by one number, bodies first: this is the only place that counts.
#pragma once

#include "base/contact.hpp"
#include "engine/prepare/model.hpp"

namespace trocar::engine {

/// A body or an instrument of a model.
struct Thing {
    enum class Kind : std::uint8_t { Body, Instrument } kind = Kind::Body;
    std::size_t index = 0; // into SceneModel::bodies, or SceneModel::instruments

    [[nodiscard]] bool is_body() const noexcept { return kind == Kind::Body; }
    [[nodiscard]] bool operator==(const Thing&) const noexcept = default;
};

[[nodiscard]] inline BodyId id_of_body(std::size_t body) noexcept { return static_cast<BodyId>(body); }
[[nodiscard]] inline BodyId id_of_instrument(const SceneModel& model, std::size_t instrument) noexcept {
    return static_cast<BodyId>(model.bodies.size() + instrument);
}
[[nodiscard]] inline Thing thing_of(const SceneModel& model, BodyId id) noexcept {
    if (id < model.bodies.size()) return {Thing::Kind::Body, id};
    return {Thing::Kind::Instrument, id - model.bodies.size()};
}

/// Neither of the two is an instrument.
[[nodiscard]] inline bool is_between_bodies(const SceneModel& model, const Contact& contact) noexcept {
    return thing_of(model, contact.body_a).is_body() && thing_of(model, contact.body_b).is_body();
}

} // namespace trocar::engine
