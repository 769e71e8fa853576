// Settings of contact and response: what a scene says under "contact", and what the step reads.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace trocar::engine {

/// How tested pairs of solid bodies push. The order of each of these enums is that of the scene's words for it.
enum class SolidResponse : std::uint8_t {
    Surface, // by impulses at places of the surfaces beneath the leaves; open surfaces as Spheres
    Spheres, // by the overlap of the spheres, as in the sphere-tree paper
};

/// Which spheres solid bodies have.
enum class SphereTrees : std::uint8_t {
    Covering,  // around groups of triangles, all of them fitted to the surface's corners in every step
    Wrapped,   // from the medial axis, each evaluated lazily from the coarse nodes; they hold their surface under any deformation
    Heuristic, // the same, moved as in the sphere-tree paper: they may lose surface
};
inline constexpr std::array<std::string_view, 3> kSphereTreeWords{"covering", "wrapped", "heuristic"};

/// Whether image-space culling filters the exact stage's candidates before they are tested.
enum class Culling : std::uint8_t {
    Auto, // where that is predicted to pay: on a graphics card if there is one, on the CPU otherwise
    Never,
    Cpu,    // always, by the CPU reference
    OpenGl, // always, by OpenGL, hardware or software; by the CPU reference where there is none
};

/// Parameters of contact and response, the same for all pairs. Preparation lowers the clearance for thin instruments and the distance
/// with it, and takes solid_friction away without the effect friction.
struct ContactSpec {
    double clearance = 1.0e-4;      // m, clearance that the response keeps between skin and wall: ten times the exact tests' distance
    double exact_distance = 1.0e-5; // m, closer than this counts as touching in the exact tests
    double margin = 3.0e-4;         // m, coarse contacts are reported from this far
    double rod_stiffness = 1.0e6;   // N/m, behind the planes of the rod's solve, where those contradict each other: 1 N presses 1 um
    double wall_stiffness = 2.0e4;  // N/m, at most, of a rod's press as the tissue's integration feels it: stiffer ones shorten its sub-steps
    double solid_stiffness = 200.0; // N/m; without effect
    double solid_damping = 0.0;     // N s/m; without effect
    double solid_friction = 0.0;    // Coulomb mu between solid bodies, with the effect friction
    SolidResponse solid_response = SolidResponse::Surface;
    SphereTrees sphere_trees = SphereTrees::Covering; // of solid bodies
    double assumed_depth = 5.0e-4;                    // m, deepest that an untested pair may count
    Culling culling = Culling::Auto;                  // of the exact stage's candidates
};

} // namespace trocar::engine
