// Deformable bodies and instruments against themselves. For bodies it is part of the step's contact between solids:
// engine/step/solid/self_touch.hpp; for instruments of the solve of their rod: fem/rod/self_contact.hpp.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine::effects {

const EffectDescriptor self_contact{
    .name = "self_contact",
    .label = "self-contact",
    .doc = "Solid bodies against themselves, where their leaf spheres lay apart at rest, and instruments against themselves; needs coarse_contact.",
    .acts_on =
        [](const SceneModel& model) {
            const auto may_touch = [](const BodyModel& body) { return body.self_contact && body.links && !body.hollow; };
            const auto meets_itself = [](const InstrumentModel& instrument) { return instrument.self_contact; };
            return model.effects.self_contact &&
                   (any_body(model, may_touch) || std::any_of(model.instruments.begin(), model.instruments.end(), meets_itself));
        },
    .remove = [](SceneModel& model) { model.effects.self_contact = false; },
    .explain = [](const Scene& scene, const SceneModel& model) -> EffectLine {
        const auto rods = std::count_if(model.instruments.begin(), model.instruments.end(), [](const InstrumentModel& i) { return i.self_contact; });
        const bool bodies = any_body(model, deforms);
        if (!bodies && rods == 0) return {false, "no body deforms, and no instrument is a rod of its own"};
        if (!scene.effects.coarse_contact) return {false, "needs the effect coarse_contact"};
        const bool on = scene.effects.self_contact;
        std::string what = bodies ? "deformable bodies against themselves, by their sphere trees" : "";
        if (rods > 0)
            what += fmt::format("{}{} instrument{} against {}, by pairs of segments: continuous", bodies ? "; " : "", rods, rods == 1 ? "" : "s",
                                rods == 1 ? "itself" : "themselves");
        return {on, listed(on, what)};
    },
    .floor = [](const SceneModel& model) -> std::string {
        const bool rods = std::any_of(model.instruments.begin(), model.instruments.end(), [](const InstrumentModel& i) { return i.self_contact; });
        return std::string("the root sphere of each such body against itself, and places that pressed in the last step") +
               (rods ? "; of instruments all of it: pairs of segments near one another and the solve between them, charged" : "");
    },
};

} // namespace trocar::engine::effects
