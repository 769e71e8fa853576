// A small cloth simulator, for sequences to detect collisions in: the four animations of Wong 2009, at any size. The
// same bits on every machine. No cloth meets itself in it, so layers may pass through each other; that is what is to be found.
// source   Mueller, Heidelberger, Hennix, Ratcliff, "Position based dynamics" (2007); scenes after Wong (2009)
#pragma once

#include "base/vec.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace trocar::engine {

/// Two surfaces, the rigid one first.
struct ClothSequence {
    std::vector<Triangle> triangles[2];
    std::vector<std::vector<Vec3>> frames[2]; // [surface][frame][vertex] m
    [[nodiscard]] std::size_t step_count() const noexcept { return frames[0].size() - 1; }
};

enum class ClothScene : std::uint8_t {
    SpinningBall, // a cloth lies down on a ball that spins
    BallCloth,    // a ball flies into a hanging cloth
    FourCones,    // a cloth falls on four cones
    Garment,      // a skirt around a swaying, turning body
};

/// rigid, cloth   triangles, about      steps   that are recorded, after the cloth has come to the solid
[[nodiscard]] ClothSequence make_cloth_sequence(ClothScene scene, std::size_t rigid, std::size_t cloth, std::size_t steps);

} // namespace trocar::engine
