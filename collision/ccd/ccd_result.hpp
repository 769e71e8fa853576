// What the exact continuous tests of ccd.hpp answer.
#pragma once

#include "base/vec.hpp"

#include <array>
#include <cstdint>

namespace trocar::collision {

/// Which stage decided; the last one is the dear one.
enum class Decision : std::uint8_t { Filter, Proof, Exact };

struct CcdResult {
    bool meets = false;
    Decision decided_by = Decision::Filter;
    double time = 1.0; // [0, 1] time of impact, within kTimeOfImpactError; where the features start in contact, 0 exactly
    std::array<double, 3> bary = {1.0, 0.0, 0.0}; // as in Sweep, at that time
    Vec3 normal = Vec3::UnitX();                  // unit, from face to vertex, from b to a, on the side where they started
};

/// Error of CcdResult.time: of a contact that stage 2 or 3 decided, where the features really cross; stage 4 has the root to 2^-48.
inline constexpr double kTimeOfImpactError = 0x1p-30;

} // namespace trocar::collision
