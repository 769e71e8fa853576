#include "engine/prepare/vessel_flow.hpp"

#include "engine/prepare/geometry_cache.hpp"
#include "engine/prepare/prepare_body.hpp"

#include <fmt/format.h>

namespace trocar::engine {

Result<void> prepare_vessel_flow(const EffectPreparation& preparation, const std::string& key, double speed, const SceneTarget* inlet_spec) {
    const auto& [scene, coarse, shelf, prepared] = preparation;
    std::optional<Place> inlet;
    if (inlet_spec != nullptr) {
        const auto place = find_place(scene, inlet_spec->place, key + ".inlet", shelf);
        if (!place.ok()) return place.error();
        inlet = *place;
    }
    bool inlet_used = false;
    for (InstrumentModel& instrument : prepared.model.instruments) {
        BodyModel& vessel = prepared.model.bodies[instrument.lumen];
        if (vessel.is_free_space) continue;
        if (!vessel.blood) {
            auto tree = make_or_read_centreline(*vessel.lumen, inlet ? inlet->position : instrument.port.position);
            const bool from_inlet = inlet && tree.ok();
            inlet_used |= from_inlet;
            if (inlet && !tree.ok()) tree = make_or_read_centreline(*vessel.lumen, instrument.port.position);
            if (tree.ok() && !from_inlet)
                tree = make_or_read_centreline(*vessel.lumen, find_inflow(*tree, instrument.port.direction));
            if (!tree.ok()) return scene_error(scene, key, tree.error().message, tree.error().code);
            vessel.blood = make_blood_flow(*tree, speed);
            auto links = link_to_host(scene, coarse, prepared.model, instrument.lumen, vessel.blood->points);
            if (!links.ok()) return links.error();
            vessel.blood->links = std::move(*links);
        }
        instrument.flow_entry = find_flow_point(*vessel.blood, instrument.port.position);
    }
    if (!inlet || inlet_used || prepared.model.instruments.empty()) return {};
    return scene_error(scene, key + ".inlet",
                       fmt::format("({:.4g}, {:.4g}, {:.4g}) mm lies in no vessel that an instrument moves in; expected a place inside",
                                   1e3 * inlet->position.x(), 1e3 * inlet->position.y(), 1e3 * inlet->position.z()));
}

} // namespace trocar::engine
