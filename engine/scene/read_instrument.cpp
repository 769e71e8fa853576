#include "engine/scene/describe_instrument.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/read_design.hpp"
#include "engine/scene/read_keys.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace trocar::engine {
namespace {


std::vector<std::string_view> recipe_bodies(const Scene& scene) {
    std::vector<std::string_view> names;
    for (const SceneBody& body : scene.bodies)
        if (body.surface.source == SurfaceSource::Recipe) names.push_back(body.name);
    return names;
}

/// All recipe bodies that share one file are one patient: any of them serves.
Index only_patient(const Scene& scene) {
    Index found = kNoIndex;
    for (Index i = 0; i < scene.bodies.size(); ++i) {
        const SurfaceSpec& surface = scene.bodies[i].surface;
        if (surface.source != SurfaceSource::Recipe) continue;
        if (found != kNoIndex && scene.bodies[found].surface.file != surface.file) return kNoIndex;
        if (found == kNoIndex) found = i;
    }
    return found;
}

/// preferred  body to take where none is named; kNoIndex: the scene's only patient
std::optional<Error> read_place(const CheckContext& context, const Values& values, const Scene& scene, Index preferred, PlaceSpec& place) {
    place.landmark = values.text("landmark");
    const std::vector<std::string_view> known = recipe_bodies(scene);
    if (values.has("body")) {
        const std::string name = values.text("body");
        place.body = find_body(scene, name);
        if (place.body == kNoIndex) return fail_at(context, values, "body", refuse_unknown("body", name, known));
        if (scene.bodies[place.body].surface.source != SurfaceSource::Recipe)
            return fail_at(
                context, values, "body",
                fmt::format("the body \"{}\" comes from no recipe, so it has no landmarks; {}", name, suggest("recipe body", name, known)));
        return std::nullopt;
    }
    const bool use_preferred = preferred != kNoIndex && scene.bodies[preferred].surface.source == SurfaceSource::Recipe;
    place.body = use_preferred ? preferred : only_patient(scene);
    if (place.body != kNoIndex) return std::nullopt;
    return fail_at(context, values, "landmark",
                   known.empty() ? "no body of this scene comes from a recipe, so there are no landmarks; expected a position"
                                 : "the scene has several patients; expected the key \"body\" beside it");
}

std::optional<Error> read_entry(const CheckContext& context, const Values& instrument, const Scene& scene, Index lumen, PlaceSpec& place) {
    const Values values = instrument.object("entry");
    if (instrument.find("entry")->find("landmark") != nullptr) return read_place(context, values, scene, lumen, place);
    return read_keys<EntryPositionKeys>({context, values, scene}, place);
}

std::optional<Error> read_lumen(const CheckContext& context, const Values& values, const Scene& scene, Index& lumen) {
    const std::string name = values.text("lumen");
    std::vector<std::string_view> hollow;
    for (const SceneBody& body : scene.bodies)
        if (body.hollow) hollow.push_back(body.name);
    lumen = find_body(scene, name);
    if (lumen == kNoIndex) return fail_at(context, values, "lumen", refuse_unknown("hollow body", name, hollow));
    if (scene.bodies[lumen].hollow) return std::nullopt;
    return fail_at(
        context, values, "lumen",
        fmt::format("the body \"{}\" is not hollow, so nothing can be inside of it; {}", name, suggest("hollow body", name, hollow)));
}

std::optional<Error> read_surroundings(const CheckContext& context, const Values& values, const Scene& scene, SceneInstrument& instrument) {
    for (const std::string_view key : {"entry", "lumen"})
        if (!values.has(key))
            return fail_at(context, values, key,
                           fmt::format("the key \"{}\" is missing; expected it, or \"inside\" with the name of an instrument", key));
    if (auto error = read_lumen(context, values, scene, instrument.lumen)) return error;
    return read_entry(context, values, scene, instrument.lumen, instrument.entry);
}

/// Why a pair of rods is no wire in a catheter, as a message; empty: it is one.
std::string refuse_pair(const Scene& scene, const SceneInstrument& outer, const SceneInstrument& inner, const Units& units) {
    for (const SceneInstrument* one : {&outer, &inner})
        if (one->kind != InstrumentKind::Rod) return fmt::format("{} is a mass_spring; expected the kind \"rod\" for both", one->name);
    if (outer.inside != kNoIndex)
        return fmt::format("{} runs inside {} itself; expected that one: no more than two rods lie in one another", outer.name, scene.instruments[outer.inside].name);
    for (const SceneInstrument& other : scene.instruments)
        if (other.inside != kNoIndex && scene.instruments[other.inside].name == outer.name)
            return fmt::format("{} runs inside {} already; expected one wire to a catheter", other.name, outer.name);
    const double room = outer.inner_radius > 0.0 ? outer.inner_radius : outer.design.radius;
    if (inner.design.radius < room) return {};
    return fmt::format("its radius is {}, that of {}{} is {}; expected a thinner wire", with_unit(inner.design.radius, Dimension::Length, units),
                       outer.name, outer.inner_radius > 0.0 ? "'s bore" : "", with_unit(room, Dimension::Length, units));
}

std::optional<Error> read_inside(const CheckContext& context, const Values& values, const Scene& scene, SceneInstrument& instrument) {
    for (const std::string_view key : {"entry", "lumen"})
        if (values.has(key))
            return fail_at(context, values, key, "unused: it runs inside an instrument, with whose entry and lumen; expected it left out");
    const std::string name = values.text("inside");
    std::vector<std::string_view> known;
    Index outer = kNoIndex;
    for (Index i = 0; i < scene.instruments.size(); ++i) {
        known.push_back(scene.instruments[i].name);
        if (scene.instruments[i].name == name) outer = i;
    }
    if (outer == kNoIndex)
        return fail_at(context, values, "inside",
                       refuse_unknown("instrument above this one (a catheter stands before the wire in it)", name, known));
    if (const std::string problem = refuse_pair(scene, scene.instruments[outer], instrument, context.units); !problem.empty())
        return fail_at(context, values, "inside", problem);
    if (scene.instruments[outer].detachable)
        return fail_at(context, values, "inside", fmt::format("found {}, which is detachable; expected one that stays in its port", name));
    if (scene.instruments[outer].tip_clamp)
        return fail_at(context, values, "inside", fmt::format("found {}, whose tip is clamped; expected one without tip_clamp", name));
    if (values.has("play") && instrument.play && !(scene.instruments[outer].inner_radius > 0.0))
        return fail_at(context, values, "play", fmt::format("found true, but {} states no inner_radius; expected one, or false", name));
    instrument.inside = outer;
    instrument.lumen = scene.instruments[outer].lumen;
    instrument.entry = scene.instruments[outer].entry;
    return std::nullopt;
}

std::optional<Error> check_follow(const CheckContext& context, const Values& instrument, double speed_limit, double speed) {
    if (speed <= speed_limit * (1.0 + kLimitTolerance)) return std::nullopt;
    return fail_at(context, instrument.object("follow"), "speed",
                   fmt::format("found {}; expected at most the drive's limit, {}, or a higher \"limits\": "
                               "{{\"speed\": ...}} in the instrument",
                               with_unit(speed, Dimension::Speed, context.units), with_unit(speed_limit, Dimension::Speed, context.units)));
}

/// Where it starts, and what moves it.
std::optional<Error> read_script(const CheckContext& context, const Values& values, SceneInstrument& instrument) {
    if (values.has("path") && values.has("follow"))
        return fail_at(context, values, "follow", "found both a path and follow; expected one of them");
    if (values.has("path"))
        if (auto error = read_path(context, values, instrument)) return error;
    if (values.has("follow"))
        if (auto error = check_follow(context, values, instrument.limits.speed, instrument.follow->settings.speed)) return error;
    const double start = instrument.path.empty() ? 0.0 : instrument.path.front().insertion;
    if (!values.has("inserted")) instrument.inserted = start;
    const auto length_text = [&](double length) { return with_unit(length, Dimension::Length, context.units); };
    if (instrument.inserted > instrument.design.length)
        return fail_at(context, values, "inserted",
                       fmt::format("found {}; expected at most the instrument's length, {}", length_text(instrument.inserted),
                                   length_text(instrument.design.length)));
    if (instrument.path.empty() || std::abs(instrument.inserted - start) <= 1e-9) return std::nullopt;
    return fail_at(context, values, "inserted",
                   fmt::format("found {}, but the path's first row begins at {}; expected this left out", length_text(instrument.inserted),
                               length_text(start)));
}

} // namespace

static std::optional<Error> check_tip(const Reading& reading, const SceneInstrument& instrument) {
    const auto& [context, values, scene] = reading;
    if (instrument.detachable && (instrument.kind != InstrumentKind::Rod || values.has("inside") || instrument.tip_clamp))
        return fail_at(context, values, "detachable", "found true for a rod in a bore or with a clamped tip, or a mass-spring chain; expected kind \"rod\", not inside another, its tip free");
    if (instrument.tip_load) {
        const Values load = values.object("tip_load");
        if (!load.has("force") && !load.has("torque"))
            return fail_at(context, values, "tip_load", "found neither force nor torque; expected one of them at least");
    }
    if (!instrument.tip_clamp) return std::nullopt;
    const Values clamp = values.object("tip_clamp");
    if (instrument.kind != InstrumentKind::Rod || values.has("inside"))
        return fail_at(context, values, "tip_clamp", "found for a rod in a bore or a mass-spring chain; expected kind \"rod\", not inside another");
    if (instrument.tip_clamp->spins && !instrument.tip_clamp->rotation.empty())
        return fail_at(context, clamp, "rotation", "found beside spins; expected one of them");
    for (const char* key : {"turn_point", "turn_axis"})
        if (clamp.has(key) && instrument.tip_clamp->turns.empty())
            return fail_at(context, clamp, key, "unused key: nothing turns here; expected turns added or this left out");
    return std::nullopt;
}

std::optional<Error> read_follow_target(const Reading& follow, Index& target) {
    if (!follow.values.has("target")) return std::nullopt;
    const std::string name = follow.values.text("target");
    std::vector<std::string_view> known;
    for (const SceneTarget& each : follow.scene.targets) known.push_back(each.name);
    target = find_target(follow.scene, name);
    if (target != kNoIndex) return std::nullopt;
    return fail_at(follow.context, follow.values, "target", refuse_unknown("target", name, known));
}

std::optional<Error> read_target(const Reading& reading, SceneTarget& target) {
    if (reading.values.kind_is("target position")) return read_keys<TargetPositionKeys>(reading, target.place);
    return read_place(reading.context, reading.values, reading.scene, kNoIndex, target.place);
}

std::optional<Error> read_instrument(const Reading& reading, SceneInstrument& instrument) {
    const auto& [context, values, scene] = reading;
    if (values.has("device")) {
        if (auto error = begin_as_device(context, values, instrument)) return error;
    } else {
        for (const char* key : {"length", "radius"})
            if (!values.has(key))
                return fail_at(context, values, key,
                               fmt::format("the key \"{}\" is missing; expected {}, or a device", key, expected(table_of<InstrumentKeys>().find(key)->value, context.units)));
    }
    if (auto error = read_design(reading, instrument)) return error;
    if (auto error = check_tip(reading, instrument)) return error;
    if (values.has("play") && !values.has("inside")) return fail_at(context, values, "play", "unused: it runs inside no instrument; expected it left out");
    if (auto error =
            values.has("inside") ? read_inside(context, values, scene, instrument) : read_surroundings(context, values, scene, instrument))
        return error;
    return read_script(context, values, instrument);
}

} // namespace trocar::engine
