#include "engine/viewer/picker.hpp"

#include <fmt/format.h>

namespace trocar::engine::viewer {

namespace {

/// Times its radius: an instrument needs this much around it where it begins.
constexpr double kRoom = 1.3;

} // namespace

Picker::Picker(const SceneModel& model) : model_(model) {
    if (model.instruments.empty()) return;
    const InstrumentModel& instrument = model.instruments[kLeadInstrument];
    if (model.bodies[instrument.lumen].is_free_space) return;
    if (auto places = LumenPlaces::make(*model.bodies[instrument.lumen].lumen, instrument.port.position); places.ok()) places_ = std::move(*places);
}

Result<void> Picker::pick(const PickPlace& click) {
    if (!places_) return Error{ErrorCode::BadUsage, "the scene has no vessel that an instrument moves in: there is nothing to pick"};
    const InstrumentModel& instrument = model_.instruments[kLeadInstrument];
    if (click.body != instrument.lumen)
        return Error{ErrorCode::BadUsage, fmt::format("{} is not the vessel that {} moves in; expected {}", model_.bodies[click.body].name,
                                                      instrument.name, model_.bodies[instrument.lumen].name)};
    const TriMesh& wall = model_.bodies[click.body].surface;
    WallPoint at{click.triangle, Vec3::Zero()};
    for (std::size_t corner = 0; corner < 3; ++corner) at.point += click.weights[corner] * wall.vertices[wall.triangles[click.triangle][corner]];
    if (click.what == PickPlace::What::Target) {
        picks_.target = places_->middle_at(at);
        return {};
    }
    const auto entry = places_->entry_at(at);
    if (!entry.ok()) return entry.error();
    picks_.entry = PickedEntry{*entry, places_->free_ahead(*entry, kRoom * instrument.rod.design.radius, instrument.rod.design.length)};
    return {};
}

} // namespace trocar::engine::viewer
