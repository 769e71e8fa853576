// Reads "effects": a list of names, or an object by name.
#include "engine/scene/describe_effects.hpp"
#include "engine/scene/read_keys.hpp"

#include <fmt/format.h>

#include <deque>
#include <set>

namespace trocar::engine {
namespace {

/// Names of the effects that are on.
using Names = std::set<std::string_view>;

std::optional<Error> read_names(const CheckContext& context, const JsonNode& node, Names& on) {
    if (node.type == JsonType::Object)
        for (const JsonNode& member : node.children)
            if (member.type == JsonType::Object || member.flag) on.insert(member.key);
    if (node.type == JsonType::List)
        for (std::size_t i = 0; i < node.children.size(); ++i)
            if (const JsonNode& name = node.children[i]; !on.insert(name.text).second)
                return error_at(context, name.at, fmt::format("effects[{}]", i),
                                fmt::format("the effect \"{}\" is listed twice; expected once", name.text));
    return std::nullopt;
}

std::optional<Error> switch_effect(const Reading&, const Names& on, const Key<bool>& effect) {
    *effect.member = on.contains(effect.field.key);
    return std::nullopt;
}
/// One with settings: those that its object has, the defaults otherwise.
template <class Keys, class T>
std::optional<Error> switch_effect(const Reading& effects, const Names& on, const ObjectKey<Keys, T, true>& effect) {
    if (!on.contains(effect.field.key)) return std::nullopt;
    return read_keys<Keys>({effects.context, effects.values.object(effect.field.key), effects.scene}, effect.member->emplace());
}

std::optional<Error> switch_effect(const Reading&, const Names&, const NoKey<std::vector<AddedEffect>>&) { return std::nullopt; }

/// Numbers of an effect that is known by its descriptor alone.
AddedEffect read_added(const Values& effects, const EffectDescriptor& effect) {
    AddedEffect added{&effect, {}};
    if (effect.settings.empty()) return added;
    const Values settings = effects.object(effect.name);
    for (const FieldSpec& field : effect.settings)
        if (field.value.kind == ValueKind::Vector)
            for (int axis = 0; axis < 3; ++axis) added.settings.push_back(settings.vector(field.key)[axis]);
        else if (field.value.kind == ValueKind::Choice)
            added.settings.push_back(static_cast<double>(settings.has(field.key) ? settings.choice(field.key) : 0));
        else
            added.settings.push_back(settings.number(field.key));
    return added;
}

/// Its key: a flag, or the object of its settings, which lives as long as the program.
FieldSpec added_field(const EffectDescriptor& effect) {
    if (effect.settings.empty()) return flag_field(effect.name, effect.doc).by_default(false);
    static std::deque<ObjectSpec> objects;
    const ObjectSpec& object = objects.emplace_back(ObjectSpec{effect.name, effect.doc, "", "", effect.settings});
    return value_field(effect.name, any_value({flag_field("", "").value, object_value(object)}), effect.doc).by_default(false);
}

bool is_on(bool flag) { return flag; }
template <class T>
bool is_on(const std::optional<T>& settings) {
    return settings.has_value();
}

} // namespace

std::vector<std::string> Effects::names() const {
    std::vector<std::string> all;
    const auto add = [&](const auto& one) {
        if constexpr (requires { one.field; })
            if (is_on(*one.member)) all.emplace_back(one.field.key);
    };
    std::apply([&](const auto&... one) { (add(one), ...); }, EffectsKeys::of(*this).entries);
    for (const AddedEffect& effect : added) all.emplace_back(effect.effect->name);
    return all;
}

const ObjectSpec& effects_table() {
    static const ObjectSpec table = [] {
        ObjectSpec made = table_of<EffectsKeys>();
        for (const EffectDescriptor* effect : registered_effects())
            if (made.find(effect->name) == nullptr) made.fields.push_back(added_field(*effect));
        return made;
    }();
    return table;
}

std::optional<Error> read_inlet(const Reading& reading, std::optional<SceneTarget>& inlet) {
    if (!reading.values.has("inlet")) return std::nullopt;
    return read_target({reading.context, reading.values.object("inlet"), reading.scene}, inlet.emplace());
}

std::optional<Error> read_effects(const Reading& scene, Effects& effects) {
    const auto& [context, root, unused] = scene;
    const JsonNode* node = root.find("effects");
    if (node == nullptr) {
        effects.elasticity = effects.damping = effects.coarse_contact = effects.exact_contact = effects.friction = true;
        effects.gravity = root.has("gravity");
        return std::nullopt;
    }
    Names on;
    if (auto error = read_names(context, *node, on)) return error;
    const Values values = root.object("effects");
    std::optional<Error> error;
    const auto read = [&, &reading = scene](const auto& one) {
        error = switch_effect({reading.context, values, reading.scene}, on, one);
        return error.has_value();
    };
    std::apply([&](const auto&... one) { (read(one) || ...); }, EffectsKeys::of(effects).entries);
    if (error) return error;
    for (const EffectDescriptor* effect : registered_effects())
        if (on.contains(effect->name) && table_of<EffectsKeys>().find(effect->name) == nullptr)
            effects.added.push_back(read_added(values, *effect));
    if (effects.gravity && !root.has("gravity"))
        return error_at(context, node->at, "effects", "the effect gravity needs the key \"gravity\" of the scene; expected it added");
    if (!effects.blood_drag || effects.blood_drag->blood.pulsatility == 0.0 || effects.pulse) return std::nullopt;
    return fail_at(
        context, values.object("blood_drag"), "pulsatility",
        fmt::format("found {:g}, but the effect pulse is off; expected it among the effects, or 0", effects.blood_drag->blood.pulsatility));
}

} // namespace trocar::engine
