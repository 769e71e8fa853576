// The target and the entry that a person picks on the wall of the vessel that the first instrument moves in.
#pragma once

#include "engine/prepare/model.hpp"
#include "engine/viewer/lumen_places.hpp"
#include "engine/viewer/picks.hpp"

#include <optional>

namespace trocar::engine::viewer {

struct PickedEntry {
    EntryPlace place;
    double free_ahead = 0.0; // m, straight, that the instrument has room for
};
struct Picks {
    std::optional<MiddlePlace> target;
    std::optional<PickedEntry> entry;
};

class Picker {
public:
    /// model  must outlive it
    explicit Picker(const SceneModel& model);

    /// Of the vessel; nullptr: the scene has no instrument, or the instrument's entry lies outside of every inscribed sphere.
    [[nodiscard]] const LumenPlaces* places() const noexcept { return places_ ? &*places_ : nullptr; }
    [[nodiscard]] const Picks& picks() const noexcept { return picks_; }

    /// fails  BadUsage: the body is not the vessel; BadValue: as LumenPlaces::entry_at
    [[nodiscard]] Result<void> pick(const PickPlace& click);
    void forget() noexcept { picks_ = {}; }

private:
    const SceneModel& model_;
    std::optional<LumenPlaces> places_;
    Picks picks_;
};

} // namespace trocar::engine::viewer
