// Other ways to answer a scene's contacts, by name: what `cost --variants` compares with the scene's own.
#pragma once

#include "base/result.hpp"
#include "engine/scene/scene.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// What can be asked for, each with a sentence.
struct VariantWord {
    std::string_view name, does;
};
[[nodiscard]] std::vector<VariantWord> list_variants();

/// The scene with one thing changed: the sphere trees (covering, wrapped,
/// heuristic), the solids' response (surface, spheres), without the exact stage (coarse), or with its candidates culled (culled-cpu, culled-gl).
/// fails     an unknown name, or a variant that is what the scene says already
[[nodiscard]] Result<Scene> make_variant(const Scene& scene, std::string_view name);

} // namespace trocar::engine
