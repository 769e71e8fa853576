#include "engine/experiments/cost_variants.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

Error variant_error(std::string message) { return {ErrorCode::BadUsage, std::move(message), {}, 0, 0, "--variants"}; }

std::string known_variants() {
    std::string names;
    for (const VariantWord& word : list_variants()) names += fmt::format("{}{}", names.empty() ? "" : ", ", word.name);
    return names;
}

} // namespace

std::vector<VariantWord> list_variants() {
    return {{"covering", "sphere trees fitted to the surface in every step"},
            {"wrapped", "medial sphere trees that hold their surface whatever it does"},
            {"heuristic", "the same, moved as their paper moves them: they may lose surface"},
            {"surface", "solids push by the depth of their surfaces"},
            {"spheres", "solids push by the overlap of their spheres, as in the sphere-tree paper"},
            {"coarse", "without the exact stage"},
            {"culled-cpu", "the exact stage's candidates are filtered by chromatic sets in image space first, by the CPU reference"},
            {"culled-gl", "the same by OpenGL, in software where there is no graphics card"}};
}

Result<Scene> make_variant(const Scene& scene, std::string_view name) {
    Scene variant = scene;
    bool changed = false;
    const auto word = std::find(kSphereTreeWords.begin(), kSphereTreeWords.end(), name);
    if (word != kSphereTreeWords.end()) {
        const auto trees = static_cast<SphereTrees>(word - kSphereTreeWords.begin());
        changed = variant.contact.sphere_trees != trees;
        variant.contact.sphere_trees = trees;
    } else if (name == "surface" || name == "spheres") {
        const SolidResponse response = name == "spheres" ? SolidResponse::Spheres : SolidResponse::Surface;
        changed = variant.contact.solid_response != response;
        variant.contact.solid_response = response;
    } else if (name == "coarse") {
        changed = variant.effects.exact_contact;
        variant.effects.exact_contact = false;
    } else if (name == "culled-cpu" || name == "culled-gl") {
        const Culling culling = name == "culled-gl" ? Culling::OpenGl : Culling::Cpu;
        changed = variant.contact.culling != culling;
        variant.contact.culling = culling;
    } else {
        return variant_error(fmt::format("\"{}\" is none; known: {}", name, known_variants()));
    }
    if (!changed) return variant_error(fmt::format("\"{}\" is what the scene says already", name));
    return variant;
}

} // namespace trocar::engine
