// Reads "effects": a list of names, or an object by name.
#include "engine/scene/describe_effects.hpp"
#include "engine/scene/read_keys.hpp"

#include <fmt/format.h>

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

} // namespace

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
    if (effects.gravity && !root.has("gravity"))
        return error_at(context, node->at, "effects", "the effect gravity needs the key \"gravity\" of the scene; expected it added");
    if (!effects.blood_drag || effects.blood_drag->blood.pulsatility == 0.0 || effects.pulse) return std::nullopt;
    return fail_at(
        context, values.object("blood_drag"), "pulsatility",
        fmt::format("found {:g}, but the effect pulse is off; expected it among the effects, or 0", effects.blood_drag->blood.pulsatility));
}

} // namespace trocar::engine
