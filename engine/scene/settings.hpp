// What a scene says and the step reads as it stands: its budget, contact and response, what moves an instrument's handle, and the settings
// of effects.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"
#include "engine/time/limits.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// The scene's first instrument: the one that is planned for, that the viewer's hand holds, and that columns with one number speak of.
inline constexpr std::size_t kLeadInstrument = 0;

/// What is charged to the budget.
enum class BudgetScope : std::uint8_t {
    Collision, // coarse and exact collision stages
    Step,      // the whole step
};

/// A step's budget as a scene or a command line writes it: "8ms", "work:20000", "exact".
struct BudgetSpec {
    BudgetLimits limits;
    BudgetScope scope = BudgetScope::Collision;
    std::vector<Droppable> drop = {}; // what a step may leave out when it would not fit, first to go first

    /// As it would be written: "8ms", "work:20000", "exact".
    [[nodiscard]] std::string to_string() const;
};

/// A time with its unit (ns, us, ms, s), "work:" and the number of sphere-pair tests, an integer, or "exact". Zero is allowed:
/// nothing is tested then, everything assumed.
/// fails     BadValue: no unit, not finite, negative, above kMaxBudgetSeconds, or not understood
[[nodiscard]] Result<BudgetSpec> parse_budget(std::string_view text);

/// Longest wall budget of one step. Above an hour a unit was mistaken; `exact` has no limit.
inline constexpr double kMaxBudgetSeconds = 3600.0; // s

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

/// Of a sac that is filled: which share of a ball instruments take.
struct PackingSpec {
    Vec3 centre = Vec3::Zero(); // m
    double radius = 0.0;        // m
};

/// Parameters of contact and response, the same for all pairs. Preparation lowers the clearance for thin instruments and the distance
/// with it, and takes solid_friction away without the effect friction.
struct ContactSpec {
    double clearance = 1.0e-4;      // m, clearance that the response keeps between skin and wall: ten times the exact tests' distance
    double exact_distance = 1.0e-5; // m, closer than this counts as touching in the exact tests
    double margin = 3.0e-4;         // m, coarse contacts are reported from this far
    double rod_stiffness = 1.0e6;   // N/m, behind the planes of the rod's solve, where those contradict each other: 1 N presses 1 um
    double wall_stiffness = 2.0e4;  // N/m, of tissue at most, as rod and tissue answer each other: engine/step/instrument/wall_exchange.hpp
    double solid_stiffness = 200.0; // N/m; without effect
    double solid_damping = 0.0;     // N s/m; without effect
    double solid_friction = 0.0;    // Coulomb mu between solid bodies, with the effect friction
    SolidResponse solid_response = SolidResponse::Surface;
    SphereTrees sphere_trees = SphereTrees::Covering; // of solid bodies
    double assumed_depth = 5.0e-4;                    // m, deepest that an untested pair may count
    Culling culling = Culling::Auto;                  // of the exact stage's candidates
};

enum class LoadKind : std::uint8_t {
    Force,        // N in all, shared by the nodes as by their mass
    Traction,     // Pa, on the rest area of the boundary's triangles whose nodes are all in the region
    Pressure,     // Pa, inwards, on the area of such triangles as they stand
    Acceleration, // m/s^2
    Spring,       // N/m in all, shared likewise, from the nodes to where they rest
};

/// A number at a time; linear between rows, held before the first and after the last.
struct LoadRow {
    double time = 0.0; // s, ascending
    double value = 0.0;
};

/// Where the handle is wanted at the end of a step.
struct DriveCommand {
    double insertion = 0.0; // m
    double rotation = 0.0;  // rad
};

/// Of drive commands: a surgeon's in the literature.
struct DriveLimits {
    double speed = 0.035;   // m/s, of insertion and retraction
    double rotation = 3.14; // rad/s
};

/// How the script drives the tip along a route.
struct FollowSettings {
    double speed = 0.025;      // m/s of insertion where the way is straight, at most the limit
    double look_ahead = 0.012; // m, of the route beyond the tip that the tip is turned to
    double tolerance = 0.003;  // m, to the target: arrived
};

/// Breathing moves the fixed nodes of every deformable body along a direction, there and back once a period.
struct BreathingSpec {
    double amplitude = 0.010;       // m, end to end
    double period = 4.0;            // s
    Vec3 direction = Vec3::UnitZ(); // unit, towards the head: expiration
};

/// The walls of hollow bodies widen and narrow with the heart, along BodyModel::pulse_reach.
struct PulseSpec {
    double amplitude = 0.05; // [-] of the local radius, diastole to systole
    double period = 0.9;     // s
};

/// What the blood is like; how it flows is BodyModel::blood.
struct Blood {
    double density = 1060.0;   // kg/m^3
    double viscosity = 3.5e-3; // Pa s, of whole blood where it is sheared fast
    double pulsatility = 0.0;  // [-] the speed varies by this share of its mean, most when the pulse has widened the walls
    double period = 0.9;       // s, of the pulse
};

} // namespace trocar::engine
