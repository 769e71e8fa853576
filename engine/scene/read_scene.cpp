#include "engine/io/printable.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/describe_contact.hpp"
#include "engine/scene/read_keys.hpp"
#include "engine/scene/recipe.hpp"
#include "engine/scene/scene_size.hpp"
#include "engine/scene/scene_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

constexpr double kMostSteps = 1e9;

/// Weaker or stronger gravity than on any planet: lengths and times in mixed units.
constexpr double kLeastGravity = 0.05, kMostGravity = 300.0; // m/s^2
constexpr double kUsualLeast = 1.0, kUsualMost = 30.0;       // m/s^2
constexpr double kStandardGravity = 9.80665;                 // m/s^2

std::optional<Error> read_time(const CheckContext& context, const Values& values, TimeSpec& time) {
    time.step = values.number("step");
    time.duration = values.number("duration");
    const JsonNode* substeps = values.find("substeps");
    time.substeps = substeps != nullptr && substeps->type == JsonType::Number ? static_cast<unsigned>(substeps->number) : 0;
    time.max_substeps = values.count<unsigned>("max_substeps");
    time.integrator = values.text("integrator") == "leapfrog" ? fem::Integrator::Leapfrog : fem::Integrator::Rk4;
    if (values.find("pace") != nullptr) {
        const Values pace = values.object("pace");
        time.pace = PaceSpec{pace.number("speed"), pace.text("late") == "catch_up" ? LatePolicy::CatchUp : LatePolicy::FallBehind};
    }
    const auto time_text = [&](double t) { return with_unit(t, Dimension::Time, context.units); };
    if (time.duration < time.step)
        return fail_at(
            context, values, "duration",
            fmt::format("found {}, less than a step of {}; expected at least one step", time_text(time.duration), time_text(time.step)));
    if (time.duration / time.step > kMostSteps)
        return fail_at(
            context, values, "step",
            fmt::format("found {}, which makes {:.3g} steps; expected at most 10^9", time_text(time.step), time.duration / time.step));
    if (time.substeps <= time.max_substeps) return std::nullopt;
    return fail_at(context, values, "substeps",
                   fmt::format("found {}; expected at most max_substeps, {}", time.substeps, time.max_substeps));
}

std::optional<Error> read_budget(const CheckContext& context, const Values& scene, BudgetSpec& budget) {
    const JsonNode* node = scene.find("budget");
    if (node == nullptr) return std::nullopt;
    const bool is_object = node->type == JsonType::Object;
    const Values values = scene.object("budget");
    auto parsed = parse_budget(is_object ? values.text("limit") : node->text);
    if (!parsed && is_object) return fail_at(context, values, "limit", parsed.error().message);
    if (!parsed) return fail_at(context, scene, "budget", parsed.error().message);
    budget = *parsed;
    if (is_object && values.text("scope") == "step") budget.scope = BudgetScope::Step;
    const JsonNode* drop = is_object ? values.find("drop") : nullptr;
    if (drop == nullptr) return std::nullopt;
    if (budget.scope != BudgetScope::Step && !drop->children.empty())
        return fail_at(context, values, "drop",
                       "a budget for collision leaves the exact stage out by itself and nothing "
                       "else; expected it with \"scope\": \"step\"");
    for (std::size_t i = 0; i < drop->children.size(); ++i) {
        const Droppable effect = drop->children[i].text == "elasticity" ? Droppable::Elasticity : Droppable::ExactContact;
        if (std::find(budget.drop.begin(), budget.drop.end(), effect) != budget.drop.end())
            return error_at(context, drop->children[i].at, fmt::format("budget.drop[{}]", i),
                            fmt::format("\"{}\" is listed twice; expected once", drop->children[i].text));
        budget.drop.push_back(effect);
    }
    return std::nullopt;
}

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

/// Effects that have details of their own: on or not.
struct Detailed {
    bool breathing = false, pulse = false, blood_drag = false;
};

bool* find_effect(Effects& effects, std::string_view name, Detailed& detailed) {
    if (name == "elasticity") return &effects.elasticity;
    if (name == "gravity") return &effects.gravity;
    if (name == "damping") return &effects.damping;
    if (name == "coarse_contact") return &effects.coarse_contact;
    if (name == "exact_contact") return &effects.exact_contact;
    if (name == "friction") return &effects.friction;
    if (name == "self_contact") return &effects.self_contact;
    if (name == "twist") return &effects.twist;
    if (name == "breathing") return &detailed.breathing;
    if (name == "blood_drag") return &detailed.blood_drag;
    return name == "pulse" ? &detailed.pulse : &effects.fluoroscopy;
}

std::optional<Error> read_effect_list(const CheckContext& context, const JsonNode& list, Effects& effects, Detailed& detailed) {
    for (std::size_t i = 0; i < list.children.size(); ++i) {
        const JsonNode& name = list.children[i];
        bool& on = *find_effect(effects, name.text, detailed);
        if (on)
            return error_at(context, name.at, fmt::format("effects[{}]", i),
                            fmt::format("the effect \"{}\" is listed twice; expected once", name.text));
        on = true;
    }
    return std::nullopt;
}

std::optional<Error> read_blood(const CheckContext& context, const Values& effects, Scene& scene) {
    const Values values = effects.object("blood_drag");
    BloodSpec& blood = scene.effects.blood_drag.emplace();
    blood.speed = values.number("speed");
    blood.density = values.number("density");
    blood.viscosity = values.number("viscosity");
    blood.pulsatility = values.number("pulsatility");
    if (blood.pulsatility > 0.0 && !scene.effects.pulse)
        return fail_at(context, values, "pulsatility",
                       fmt::format("found {:g}, but the effect pulse is off; expected it among the effects, or 0", blood.pulsatility));
    if (!values.has("inlet")) return std::nullopt;
    return read_target(context, values.object("inlet"), scene, blood.inlet.emplace());
}

std::optional<Error> read_effects(const CheckContext& context, const Values& root, Scene& scene) {
    Effects& effects = scene.effects;
    const JsonNode* node = root.find("effects");
    Detailed detailed;
    if (node == nullptr) {
        effects.elasticity = effects.damping = effects.coarse_contact = effects.exact_contact = effects.friction = true;
        effects.gravity = root.has("gravity");
        return std::nullopt;
    }
    if (node->type == JsonType::List)
        if (auto error = read_effect_list(context, *node, effects, detailed)) return error;
    const Values values = root.object("effects");
    if (node->type == JsonType::Object)
        for (const JsonNode& member : node->children)
            *find_effect(effects, member.key, detailed) = member.type == JsonType::Object || member.flag;
    if (effects.gravity && !root.has("gravity"))
        return error_at(context, node->at, "effects", "the effect gravity needs the key \"gravity\" of the scene; expected it added");
    if (detailed.pulse) {
        const Values pulse = values.object("pulse");
        effects.pulse = PulseSpec{pulse.number("amplitude"), pulse.number("period")};
    }
    if (detailed.blood_drag)
        if (auto error = read_blood(context, values, scene)) return error;
    if (!detailed.breathing) return std::nullopt;
    const Values details = values.object("breathing");
    BreathingSpec& spec = effects.breathing.emplace();
    spec.amplitude = details.number("amplitude");
    spec.period = details.number("period");
    return read_direction(context, details, "direction", spec.direction);
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
        if (body.kind == BodyKind::Deformable && body.fixed.empty() && effects.gravity && scene.bodies.size() == 1)
            context.questions.push_back(fmt::format("bodies.{}: nothing holds it against gravity", body.name));
    }
}

std::optional<Error> check_breathing(const CheckContext& context, const Scene& scene) {
    if (!scene.effects.breathing) return std::nullopt;
    for (const SceneBody& body : scene.bodies)
        if (body.kind == BodyKind::Deformable && !body.fixed.empty()) return std::nullopt;
    const auto place = context.positions.find("effects");
    return error_at(context, place->second, "effects",
                    "breathing moves the fixed nodes of deformable bodies, and there are none; expected it left out, or a "
                    "\"fixed\" region");
}

/// A chain of masses and springs has no angles. A pigtail always has them: a coil without torsion finds no equilibrium.
std::optional<Error> check_twist(const CheckContext& context, const Values& root, Scene& scene) {
    for (SceneInstrument& instrument : scene.instruments) {
        const bool coil = instrument.design.tip == fem::TipShape::Pigtail;
        instrument.design.torsion = scene.effects.twist || coil;
        if (instrument.kind != InstrumentKind::MassSpring) continue;
        if (coil)
            return error_at(context, context.positions.find("instruments." + instrument.name)->second, "instruments." + instrument.name,
                            "a pigtail twists, and a mass_spring has no torsion; expected the kind \"rod\"");
        if (scene.effects.twist)
            return fail_at(
                context, root, "effects",
                fmt::format("found twist, but {} is a mass_spring, which has no torsion; expected the effect left out, or the kind "
                            "\"rod\"",
                            instrument.name));
    }
    return std::nullopt;
}

PictureView to_view(std::string_view word) {
    if (word == "tip") return PictureView::Tip;
    return word == "fluoroscopy" ? PictureView::Fluoroscopy : PictureView::Anatomy;
}

/// A count is spread evenly: the last one at the end. With fluoroscopy every picture has an X-ray beside it.
void spread_pictures(unsigned count, const Scene& scene, std::vector<PictureSpec>& pictures) {
    for (unsigned i = 1; i <= count; ++i) {
        const double time = scene.time.duration * i / count;
        pictures.push_back({PictureView::Anatomy, time});
        if (scene.effects.fluoroscopy) pictures.push_back({PictureView::Fluoroscopy, time});
    }
}

std::optional<Error> read_picture(const CheckContext& context, const Values& values, const Scene& scene, PictureSpec& picture) {
    picture.view = to_view(values.text("view"));
    picture.time = values.number("time");
    if (picture.view == PictureView::Fluoroscopy && !scene.effects.fluoroscopy)
        return fail_at(context, values, "view", "found \"fluoroscopy\", but that effect is off; expected it among the effects");
    if (picture.view == PictureView::Tip && scene.instruments.empty())
        return fail_at(context, values, "view", "found \"tip\", but the scene has no instrument; expected \"anatomy\"");
    if (picture.time <= scene.time.duration) return std::nullopt;
    return fail_at(context, values, "time",
                   fmt::format("found {}; expected at most the duration, {}", with_unit(picture.time, Dimension::Time, context.units),
                               with_unit(scene.time.duration, Dimension::Time, context.units)));
}

std::optional<Error> read_outputs(const CheckContext& context, const Values& root, const Scene& scene, OutputSpec& outputs) {
    const Values values = root.object("outputs");
    outputs.record_every = values.count<unsigned>("record_every");
    if (const JsonNode* size = values.find("size")) {
        for (const JsonNode& edge : size->children)
            if (edge.number != std::floor(edge.number))
                return fail_at(context, values, "size", fmt::format("found {}; expected integers, in pixels", edge.text));
        outputs.width = static_cast<unsigned>(size->children[0].number);
        outputs.height = static_cast<unsigned>(size->children[1].number);
    }
    const JsonNode* pictures = values.find("pictures");
    if (pictures == nullptr) return std::nullopt;
    if (pictures->type == JsonType::Number) spread_pictures(static_cast<unsigned>(pictures->number), scene, outputs.pictures);
    for (std::size_t i = 0; i < pictures->children.size(); ++i) {
        const Values picture = values.element("pictures", pictures->children[i], fmt::format("{}[{}]", values.path("pictures"), i));
        if (auto error = read_picture(context, picture, scene, outputs.pictures.emplace_back())) return error;
    }
    return std::nullopt;
}

std::optional<Error> read_bodies(const CheckContext& context, const Values& root, Scene& scene) {
    const JsonNode* map = root.find("bodies");
    if (map == nullptr) return std::nullopt;
    for (const JsonNode& member : map->children) {
        SceneBody& body = scene.bodies.emplace_back();
        body.name = member.key;
        if (auto error = read_body(context, root.element("bodies", member, join_key("bodies", member.key)), body)) return error;
    }
    for (std::size_t i = 0; i < map->children.size(); ++i) {
        const JsonNode& member = map->children[i];
        const Values values = root.element("bodies", member, join_key("bodies", member.key));
        if (auto error = resolve_host_body(context, values, scene, scene.bodies[i])) return error;
    }
    return std::nullopt;
}

std::optional<Error> read_targets(const CheckContext& context, const Values& root, Scene& scene) {
    const JsonNode* map = root.find("targets");
    if (map == nullptr) return std::nullopt;
    for (const JsonNode& member : map->children) {
        SceneTarget target{member.key, {}};
        if (auto error = read_target(context, root.element("targets", member, join_key("targets", member.key)), scene, target))
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
        if (auto error =
                read_instrument(context, root.element("instruments", member, join_key("instruments", member.key)), scene, instrument))
            return error;
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
    if (auto error = read_time(context, root.object("time"), scene.time)) return error;
    if (auto error = read_budget(context, root, scene.budget)) return error;
    if (auto error = read_gravity(context, root, scene.gravity)) return error;
    if (auto error = read_keys<ContactKeys>({context, root.object("contact"), scene}, scene.contact)) return error;
    const Values cost = root.object("cost");
    scene.cost = {cost.number("patch", 0.0), cost.number("tolerance", 0.0)};
    if (auto error = check_body_count(context, root)) return error;
    if (auto error = read_bodies(context, root, scene)) return error;
    if (auto error = read_targets(context, root, scene)) return error;
    if (auto error = read_instruments(context, root, scene)) return error;
    if (auto error = check_scene_size(context, scene)) return error;
    if (auto error = read_effects(context, root, scene)) return error;
    if (auto error = check_breathing(context, scene)) return error;
    if (auto error = check_twist(context, root, scene)) return error;
    if (auto error = read_outputs(context, root, scene, scene.outputs)) return error;
    if (scene.bodies.empty()) return fail_at(context, root, "bodies", "the scene is empty; expected at least one body");
    question_effects(scene, context);
    question_contact(scene, context);
    return std::nullopt;
}

} // namespace

Result<Scene> parse_scene(std::string_view text, const std::filesystem::path& file) {
    const auto tree = parse_json_tree(text, file.string());
    if (!tree) return tree.error();
    CheckContext context{file.string(), file.parent_path(), {}, {}, {}};
    if (tree->type == JsonType::Object)
        if (auto error = read_units(*tree, units_table(), context)) return *error;
    context.questions.clear();
    if (auto error = check_object(*tree, scene_table(), "", context)) return *error;
    Scene scene;
    scene.file = file;
    if (auto error = read_all(context, Values(&tree.value(), scene_table(), context.units, ""), scene)) return *error;
    scene.questions = std::move(context.questions);
    for (const auto& [key, at] : context.positions) scene.positions[key] = {at.line, at.column};
    return scene;
}

Result<Scene> read_scene(const std::filesystem::path& file) {
    const auto text = read_json_file(file);
    if (!text) return text.error();
    return parse_scene(*text, file);
}

} // namespace trocar::engine
