// Keys of "contact".
#pragma once

#include "engine/scene/settings.hpp"
#include "engine/scene/described.hpp"

namespace trocar::engine {

struct ContactKeys {
    using Struct = ContactSpec;
    static auto of(auto& s) {
        constexpr double kLargest = 0.05; // m
        return described(
            {"contact", "Contact and response, the same for all pairs."},
            key(s.clearance, number_field("clearance", Dimension::Length, above(0.0, kLargest),
                                          "Clearance that the response keeps between an instrument's skin and a wall.")),
            key(s.exact_distance, number_field("exact_distance", Dimension::Length, between(0.0, kLargest),
                                               "Closer than this counts as touching in the exact tests.")),
            key(s.margin, number_field("margin", Dimension::Length, between(0.0, kLargest), "Coarse contacts are reported from this far.")),
            key(s.rod_stiffness,
                number_field("rod_stiffness", Dimension::Stiffness, above(0.0, 1e9), "Behind a wall as the instrument feels it, where walls contradict each other.")),
            key(s.wall_stiffness,
                number_field("wall_stiffness", Dimension::Stiffness, above(0.0, 1e9), "Of tissue behind an instrument's wall, at most, as both are solved one after the other: decides how fast they agree, not on what.")),
            key(s.solid_stiffness,
                number_field("solid_stiffness", Dimension::Stiffness, above(0.0, 1e9), "Without effect: impulses push, and no springs. Old scenes may name it.")),
            key(s.assumed_depth, number_field("assumed_depth", Dimension::Length, between(0.0, kLargest),
                                              "Deepest that a pair the budget left untested may count.")),
            key(s.solid_damping, number_field("solid_damping", Dimension::None, between(0.0, 1e6),
                                              "Without effect, as solid_stiffness.")),
            key(s.solid_friction, number_field("solid_friction", Dimension::None, between(0.0, 2.0),
                                               "Coulomb's coefficient between two solid bodies, with the effect friction.")),
            key(s.solid_response,
                choice_field(
                    "solid_response", {"surface", "spheres"},
                    "Solid bodies push by impulses at places of their surfaces beneath the leaf spheres that meet, or at the spheres, by their "
                    "overlap.")),
            key(s.sphere_trees,
                choice_field(
                    "sphere_trees", {kSphereTreeWords.begin(), kSphereTreeWords.end()},
                    "Spheres of solid bodies: around groups of triangles, fitted anew in every step; or from the medial axis, following "
                    "the coarse nodes, each evaluated lazily, so that they hold their surface under any deformation; or "
                    "the same moved as in the sphere-tree paper, which may lose surface.")),
            key(s.culling, choice_field("culling", {"auto", "never", "cpu", "opengl"},
                                        "Whether image-space culling filters the exact stage's candidates before they are tested: where "
                                        "that is predicted to pay, "
                                        "never, or always, by the CPU or by OpenGL. The contacts are the same.")));
    }
};
static_assert(describes_all<ContactKeys>);

} // namespace trocar::engine
