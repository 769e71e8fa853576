// The one contact that spheretree and collision both produce. Neither knows forces: engine/step/respond makes them.
#pragma once

#include "base/vec.hpp"

#include <cstdint>

namespace trocar {

using BodyId = std::uint16_t;

enum class ContactOrigin : std::uint8_t {
    TestedSpheres,  // two leaf spheres were tested and overlap
    AssumedSpheres, // the budget ended first: an untested pair stands for whatever lies beneath it
    Proximity,      // a place of one surface and the closest point of the other, beneath a tested pair of leaves, at the end of the step
    ExactVF,        // vertex against face, continuous test
    ExactEE,        // edge against edge, continuous test
};

/// Features and frame of one contact. The normal points from body_b to body_a: moving a along it separates.
struct Contact {
    BodyId body_a = 0;
    BodyId body_b = 0;
    ContactOrigin origin = ContactOrigin::TestedSpheres;
    Vec3 point = Vec3::Zero();                 // m, world
    Vec3 normal = Vec3::UnitX();               // unit
    double gap = 0.0;                          // m, negative: penetration along the normal
    double time = 1.0;                         // time of impact within the step, [0, 1]; 1 for what was tested at one instant only
    Index feature_a[2] = {kNoIndex, kNoIndex}; // sphere id | vertex id | edge's two vertex ids
    Index feature_b[3] = {kNoIndex, kNoIndex, kNoIndex}; // sphere id | triangle's vertex ids | edge's two vertex ids
    double bary_a[2] = {1.0, 0.0};                       // weights of feature_a's vertices
    double bary_b[3] = {1.0, 0.0, 0.0};                  // weights of feature_b's vertices
    double normal_force = 0.0;                           // N, on body_a along the normal; of what the response knows the force of
    Vec3 friction_force = Vec3::Zero();                  // N, on body_a, across the normal
};

} // namespace trocar
