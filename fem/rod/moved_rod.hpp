// A rod as those see it that look for where it meets others.
#pragma once

#include "fem/rod/rod_model.hpp"

#include <span>

namespace trocar::fem {

/// A rod in a step, from where it started to where it may end, or has ended.
struct MovedRod {
    Index id = 0;
    std::size_t lumen = 0; // rods of different lumens never meet: walls keep them apart
    const RodModel* model = nullptr;
    std::span<const Vec3> from, to; // [node_count] m
    Index first = 0; // node that has passed the port at the step's end: what is behind meets nothing
    double insertion = 0.0; // m, at the step's end
    Index inside = kNoIndex; // id of the rod before it in whose bore it has play
    double play = 0.0;       // m, of its surface from the bore's wall on all sides
    bool meets = true;       // others, from outside
};

} // namespace trocar::fem
