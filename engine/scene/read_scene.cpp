#include "engine/io/printable.hpp"
#include "engine/scene/describe_contact.hpp"
#include "engine/scene/describe_run.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/override.hpp"
#include "engine/scene/read_keys.hpp"
#include "engine/scene/recipe.hpp"
#include "engine/scene/scene_size.hpp"
#include "engine/scene/scene_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

/// Weaker or stronger gravity than on any planet: lengths and times in mixed units.
constexpr double kLeastGravity = 0.05, kMostGravity = 300.0; // m/s^2
constexpr double kUsualLeast = 1.0, kUsualMost = 30.0;       // m/s^2
constexpr double kStandardGravity = 9.80665;                 // m/s^2

std::optional<Error> read_gravity(CheckContext& context, const Values& values, Vec3& gravity) {
    gravity = values.vector("gravity");
    const double size = gravity.norm();
    if (size == 0.0) return std::nullopt;
    const auto text = [&](double a) { return with_unit(a, Dimension::Acceleration, context.units); };
    if (size < kLeastGravity || size > kMostGravity)
        return fail_at(
            context, values, "gravity",
            fmt::format("found a gravity of {}, that is {:.6g} m/s^2; expected {} as on earth", text(size), size, text(kStandardGravity)));
    if (size < kUsualLeast || size > kUsualMost)
        context.questions.push_back(fmt::format("gravity: {} is unusual: on earth it is {}", text(size), text(kStandardGravity)));
    return std::nullopt;
}

/// Settings of contact that nothing in this scene reads.
void question_contact(const Scene& scene, CheckContext& context) {
    const Effects& effects = scene.effects;
    const bool exact = effects.exact_contact && !scene.instruments.empty();
    const auto ask = [&](const char* key, bool used, const char* why) {
        if (!used && context.positions.contains(std::string("contact.") + key))
            context.questions.push_back(fmt::format("contact.{}: given, but {}", key, why));
    };
    for (const char* key : {"culling", "exact_distance"}) ask(key, exact, "no instrument has exact contacts");
    ask("solid_friction", effects.friction, "the effect friction is off");
}

/// Settings of an effect that is switched off are allowed. A question names what that leaves unused.
void question_effects(const Scene& scene, CheckContext& context) {
    const Effects& effects = scene.effects;
    if (!effects.gravity && scene.gravity.norm() > 0.0) context.questions.push_back("gravity: given, but the effect gravity is off");
    for (const SceneInstrument& instrument : scene.instruments)
        if (context.positions.contains("instruments." + instrument.name + ".friction") && !effects.friction)
            context.questions.push_back(fmt::format("instruments.{}.friction: given, but the effect friction is off", instrument.name));
    for (const SceneInstrument& instrument : scene.instruments)
        if (context.positions.contains("instruments." + instrument.name + ".poisson_ratio") && !effects.twist)
            context.questions.push_back(fmt::format("instruments.{}.poisson_ratio: given, but the effect twist is off", instrument.name));
    if (effects.blood_drag && !effects.blood_drag->inlet && !scene.instruments.empty())
        context.questions.push_back(
            "effects.blood_drag: without an inlet the blood comes in behind the instrument's entry, and flows along it");
    if (effects.exact_contact && scene.instruments.empty())
        context.questions.push_back("effects: exact_contact is of instruments, and there are none");
    for (const SceneBody& body : scene.bodies) {
        const bool damped = body.material.viscosity > 0.0 || body.material.mass_damping > 0.0;
        if (body.kind == BodyKind::Deformable && damped && !effects.damping)
            context.questions.push_back(fmt::format("bodies.{}.material: has damping, but the effect damping is off", body.name));
        if (!body.loads.empty() && !effects.loads)
            context.questions.push_back(fmt::format("bodies.{}.loads: are there, but the effect loads is off", body.name));
        const bool thrown = !body.velocity.isZero(0.0) || !body.spin.isZero(0.0), loaded = !body.loads.empty() && effects.loads;
        if (body.kind == BodyKind::Deformable && !effects.elasticity && (thrown || loaded))
            context.questions.push_back(fmt::format("bodies.{}.{}: {} there, but without the effect elasticity no body moves", body.name,
                                                    loaded ? "loads" : body.velocity.isZero(0.0) ? "spin" : "velocity", loaded ? "are" : "is"));
        if (body.kind == BodyKind::Deformable && body.fixed.empty() && effects.gravity && scene.bodies.size() == 1)
            context.questions.push_back(fmt::format("bodies.{}: nothing holds it against gravity", body.name));
    }
}

std::optional<Error> check_breathing(const CheckContext& context, const Scene& scene) {
    if (!scene.effects.breathing) return std::nullopt;
    const auto place = context.positions.find("effects");
    for (const SceneBody& body : scene.bodies)
        for (const HeldRegion& held : body.fixed)
            if (!held.moves.empty() || !held.turns.empty())
                return error_at(context, place->second, "effects",
                                fmt::format("breathing moves all fixed nodes, and those of {} move as told; expected one of both", body.name));
    for (const SceneBody& body : scene.bodies)
        if (body.kind == BodyKind::Deformable && !body.fixed.empty()) return std::nullopt;
    return error_at(context, place->second, "effects",
                    "breathing moves the fixed nodes of deformable bodies, and there are none; expected it left out, or a "
                    "\"fixed\" region");
}

/// A chain of masses and springs has no angles. A pigtail and a curve always have them, and what may leave its port: a coil without torsion finds
/// no equilibrium.
std::optional<Error> check_twist(const CheckContext& context, const Values& root, Scene& scene) {
    for (SceneInstrument& instrument : scene.instruments) {
        const bool coil = fem::always_twists(instrument.design.tip);
        instrument.design.torsion = scene.effects.twist || coil || instrument.detachable;
        if (instrument.kind != InstrumentKind::MassSpring) continue;
        if (coil)
            return error_at(context, context.positions.find("instruments." + instrument.name)->second, "instruments." + instrument.name,
                            "a pigtail or a curve twists, and a mass_spring has no torsion; expected the kind \"rod\"");
        if (scene.effects.twist)
            return fail_at(
                context, root, "effects",
                fmt::format("found twist, but {} is a mass_spring, which has no torsion; expected the effect left out, or the kind "
                            "\"rod\"",
                            instrument.name));
    }
    return std::nullopt;
}

std::optional<Error> read_bodies(const CheckContext& context, const Values& root, Scene& scene) {
    const JsonNode* map = root.find("bodies");
    if (map == nullptr) return std::nullopt;
    for (const JsonNode& member : map->children) {
        SceneBody& body = scene.bodies.emplace_back();
        body.name = member.key;
        const Values values = root.element("bodies", member, join_key("bodies", member.key));
        if (auto error = read_body({context, values, scene}, body)) return error;
    }
    for (std::size_t i = 0; i < map->children.size(); ++i) {
        const JsonNode& member = map->children[i];
        const Values values = root.element("bodies", member, join_key("bodies", member.key));
        if (auto error = resolve_host_body(context, values, scene, scene.bodies[i])) return error;
        if (auto error = resolve_around(context, values, scene, i, scene.bodies[i].surface)) return error;
    }
    return std::nullopt;
}

std::optional<Error> read_targets(const CheckContext& context, const Values& root, Scene& scene) {
    const JsonNode* map = root.find("targets");
    if (map == nullptr) return std::nullopt;
    for (const JsonNode& member : map->children) {
        SceneTarget target{member.key, {}};
        if (auto error = read_target({context, root.element("targets", member, join_key("targets", member.key)), scene}, target))
            return error;
        scene.targets.push_back(std::move(target));
    }
    return std::nullopt;
}

std::optional<Error> read_instruments(const CheckContext& context, const Values& root, Scene& scene) {
    const JsonNode* map = root.find("instruments");
    if (map == nullptr) return std::nullopt;
    for (const JsonNode& member : map->children) {
        SceneInstrument instrument;
        instrument.name = member.key;
        const Values values = root.element("instruments", member, join_key("instruments", member.key));
        if (auto error = read_instrument({context, values, scene}, instrument)) return error;
        scene.instruments.push_back(std::move(instrument));
    }
    return check_path_files(scene);
}

/// Before anything is looked up by name, which takes longer the more there are.
std::optional<Error> check_body_count(const CheckContext& context, const Values& root) {
    const JsonNode *bodies = root.find("bodies"), *instruments = root.find("instruments");
    const std::size_t count =
        (bodies != nullptr ? bodies->children.size() : 0) + (instruments != nullptr ? instruments->children.size() : 0);
    if (count <= kMostBodies) return std::nullopt;
    return fail_at(context, root, "bodies", fmt::format("found {} bodies and instruments; expected at most {}", count, kMostBodies));
}

std::optional<Error> read_all(CheckContext& context, const Values& root, Scene& scene) {
    scene.units = context.units;
    scene.name = root.has("name") ? root.text("name") : printable(scene.file.stem().string());
    const Reading reading{context, root, scene};
    if (auto error = read_time({context, root.object("time"), scene}, scene.time)) return error;
    if (auto error = read_budget(reading, scene.budget)) return error;
    if (auto error = read_gravity(context, root, scene.gravity)) return error;
    if (auto error = read_keys<ContactKeys>({context, root.object("contact"), scene}, scene.contact)) return error;
    if (auto error = read_keys<CostKeys>({context, root.object("cost"), scene}, scene.cost)) return error;
    if (auto error = check_body_count(context, root)) return error;
    if (auto error = read_bodies(context, root, scene)) return error;
    if (auto error = read_targets(context, root, scene)) return error;
    if (auto error = read_instruments(context, root, scene)) return error;
    if (auto error = check_scene_size(context, scene)) return error;
    if (auto error = read_effects(reading, scene.effects)) return error;
    if (auto error = check_breathing(context, scene)) return error;
    if (auto error = check_twist(context, root, scene)) return error;
    if (auto error = read_keys<OutputKeys>({context, root.object("outputs"), scene}, scene.outputs)) return error;
    if (scene.bodies.empty()) return fail_at(context, root, "bodies", "the scene is empty; expected at least one body");
    question_effects(scene, context);
    question_contact(scene, context);
    return std::nullopt;
}

} // namespace

namespace {

/// A mistake in a value that an override gave lies in no line of the file.
Error name_override(Error error, std::span<const SceneOverride> overrides) {
    if (error.line != 0) return error;
    for (const SceneOverride& one : overrides)
        if (const std::string key = dotted_key(one.pointer); error.key == key || error.key.starts_with(key + ".") || error.key.starts_with(key + "["))
            error.message += fmt::format("; the value was given for {}", one.pointer);
    return error;
}

Result<Scene> read_tree(const JsonNode& root, const std::filesystem::path& file) {
    const JsonNode* tree = &root;
    CheckContext context{file.string(), file.parent_path(), {}, {}, {}};
    if (tree->type == JsonType::Object)
        if (auto error = read_units(*tree, units_table(), context)) return *error;
    context.questions.clear();
    if (auto error = check_object(*tree, scene_table(), "", context)) return *error;
    Scene scene;
    scene.file = file;
    if (auto error = read_all(context, Values(tree, scene_table(), context.units, ""), scene)) return *error;
    scene.questions = std::move(context.questions);
    for (const auto& [key, at] : context.positions) scene.positions[key] = {at.line, at.column};
    return scene;
}

} // namespace

Result<Scene> parse_scene(std::string_view text, const std::filesystem::path& file) { return parse_scene(text, file, {}); }

Result<Scene> parse_scene(std::string_view text, const std::filesystem::path& file, std::span<const SceneOverride> overrides) {
    auto tree = parse_json_tree(text, file.string());
    if (!tree) return tree.error();
    for (const SceneOverride& one : overrides)
        if (auto error = apply_override(*tree, one)) {
            error->file = file.string();
            return *error;
        }
    auto scene = read_tree(*tree, file);
    if (!scene) return name_override(scene.error(), overrides);
    for (const SceneOverride& one : overrides) scene->settings.push_back(one.to_string());
    return scene;
}

Result<Scene> read_scene(const std::filesystem::path& file) { return read_scene(file, {}); }

Result<Scene> read_scene(const std::filesystem::path& file, std::span<const SceneOverride> overrides) {
    const auto text = read_json_file(file);
    if (!text) return text.error();
    return parse_scene(*text, file, overrides);
}

} // namespace trocar::engine
