// How large a scene may be. What a scene describes is counted before anything of that size is made, what a file brings as soon as it
// is read, so that a refusal costs no more memory than the text or the file itself.
#pragma once

#include "engine/scene/check.hpp"
#include "engine/scene/scene.hpp"

#include <optional>
#include <string>

namespace trocar::engine {

/// Bodies and instruments: their ids have 16 bits.
inline constexpr std::size_t kMostBodies = 1000;
/// Of all surfaces and skins together. Preparation takes about a kilobyte for each; beyond this a scene would not fit into a
/// workstation's memory, nor ever take a step in reasonable time.
inline constexpr std::size_t kMostTriangles = 10'000'000;
/// Of one shape, as many as vessels may aim at: preparation of a few million takes minutes. Of boxes and spheres neither hollow nor
/// deformable the ranges of their own keys are the limit, a few million.
inline constexpr std::size_t kMostShapeTriangles = 1'000'000;
/// Of all deformable bodies together. The plan of their forces holds distances of 32 bits (fem/tissue/force_plan.hpp), far more than these need.
inline constexpr std::size_t kMostTets = 5'000'000;

/// Triangles of the surface that a shape describes, exactly; of vessels, how many are aimed at.
[[nodiscard]] std::size_t count_triangles(const ShapeSpec& shape) noexcept;

/// "a tube of 200001 rings with 1000 sides each"
[[nodiscard]] std::string describe_size(const ShapeSpec& shape);

/// Shapes and skins; of surfaces that come from files nothing is known yet.
/// returns  the error at the key with which the scene becomes too large
[[nodiscard]] std::optional<Error> check_scene_size(const CheckContext& context, const Scene& scene);

} // namespace trocar::engine
