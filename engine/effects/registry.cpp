#include "engine/effects/registry.hpp"

#include "engine/effects/call.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

/// Those of the engine, and a reserve for the program's own.
struct Registry {
    std::array<const EffectDescriptor*, kMostEffects> all{
#define TROCAR_LIST(name) &effects::name,
        TROCAR_EFFECTS(TROCAR_LIST)
#undef TROCAR_LIST
    };
#define TROCAR_COUNT(name) +1
    std::size_t count = TROCAR_EFFECTS(TROCAR_COUNT);
#undef TROCAR_COUNT
};

constinit Registry registry;

} // namespace

std::span<const EffectDescriptor* const> registered_effects() noexcept { return {registry.all.data(), registry.count}; }

std::size_t index_of(const EffectDescriptor& effect) noexcept {
    std::size_t index = 0;
    while (index + 1 < registry.count && registry.all[index] != &effect) ++index;
    return index;
}

const EffectDescriptor* find_effect(std::string_view name) noexcept {
    for (const EffectDescriptor* effect : registered_effects())
        if (effect->name == name) return effect;
    return nullptr;
}

Result<void> add_effect(const EffectDescriptor& effect) {
    const auto wrong = [](std::string message) { return Error{.code = ErrorCode::BadValue, .message = std::move(message), .key = "effect"}; };
    if (effect.name.empty()) return wrong("found an effect without a name, expected the key by which scenes name it");
    if (find_effect(effect.name) != nullptr) return wrong(fmt::format("there is an effect \"{}\"; expected another name", effect.name));
    if (registry.count == kMostEffects) return wrong(fmt::format("there are {} effects; expected no more", kMostEffects));
    registry.all[registry.count++] = &effect;
    return {};
}

bool has_effect(const SceneModel& model, const EffectDescriptor& effect) {
    const bool is_added = std::any_of(model.effects.added.begin(), model.effects.added.end(),
                                      [&](const AddedEffect& added) { return added.effect == &effect; });
    return effect.acts_on != nullptr ? effect.acts_on(model) : is_added;
}

SceneModel without_effect(const SceneModel& model, const EffectDescriptor& effect) {
    SceneModel out = model;
    std::erase_if(out.effects.added, [&](const AddedEffect& added) { return added.effect == &effect; });
    if (effect.remove != nullptr) effect.remove(out);
    return out;
}

} // namespace trocar::engine
