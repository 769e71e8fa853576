// What the continuous tests take: vertices that move over a step, and pairs of features.
#pragma once

#include "base/vec.hpp"

namespace trocar::collision {

/// A vertex that moves on a straight line at constant speed.
struct SweptPoint {
    Vec3 t0, t1; // m
};

struct FeaturePair { // vertex and face id, or two edge ids
    Index a, b;
};

} // namespace trocar::collision
