// What is made of a rod's design, and what of it moves: model, state, what drives and what holds it. rod.hpp solves it.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"
#include "fem/rod/rod_design.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace trocar::fem {

/// Built once, then only read. Node 0 is the handle's end, node_count - 1 the tip.
struct RodModel {
    RodDesign design;
    double segment = 0.0;                              // m, as divided evenly
    std::vector<double> bend_stiffness;                // [node_count] N/m: EI / segment^3, 0 at both ends
    std::vector<double> stretch_stiffness;             // [node_count - 1] N/m: EA / segment
    std::vector<double> mass;                          // [node_count] kg
    std::vector<std::array<double, 2>> rest_curvature; // [node_count] 1/m, components along the material frame
    std::vector<double> twist_stiffness;               // [node_count - 1] N m: GJ / segment; empty without torsion
    std::vector<double> turn_inertia;                  // [node_count] kg m^2 about the axis; empty without torsion
    std::vector<double> friction_share;                // [node_count] [-] of the friction there; empty: 1 everywhere
    // Of the chain of coaxial rods alone, whose edges differ in length; empty otherwise.
    std::vector<double> rest_length;           // [node_count - 1] m; empty: `segment` everywhere
    std::vector<double> unit_edge_stiffness;   // [node_count] N m, of the change of the unit edge at a node, in place of bend_stiffness

    /// Of what bends at a node: N/m of the second difference, or N m of the change of the unit edge.
    [[nodiscard]] double bending_of(std::size_t node) const noexcept {
        return rest_length.empty() ? bend_stiffness[node] : unit_edge_stiffness[node];
    }

    /// Of the friction at a place between a node and the next.
    [[nodiscard]] double friction_at(std::size_t node, double weight) const noexcept {
        return friction_share.empty() ? 1.0 : (1.0 - weight) * friction_share[node] + weight * friction_share[node + 1];
    }

    [[nodiscard]] std::size_t node_count() const noexcept { return mass.size(); }
};

/// rad, by which a pigtail or a curve turns from segment to segment at most; 0 for other tips.
[[nodiscard]] double sharpest_node(const RodDesign& design) noexcept;

/// Refuses what no rod can be: lengths, moduli or densities that are not positive, fewer than 4 segments, rows of stiffness or coating
/// that do not ascend, arcs that do not add up to the tip's length, a pigtail or a curve that turns too far at a node.
[[nodiscard]] Result<RodModel> make_rod_model(const RodDesign& design);

struct RodState {
    std::vector<Vec3> position; // [node_count] m
    std::vector<Vec3> velocity; // [node_count] m/s
    double insertion = 0.0;     // m of rod beyond the port
    double rotation = 0.0;      // rad of the handle about the rod's axis
    std::vector<double> angle;  // [node_count] rad of the material from the frame carried without twist; empty without torsion
    std::vector<double> spin;   // [node_count] rad/s, its rate
    Vec3 root = Vec3::Zero();   // unit, across the first segment of a rod with torsion that has left its port: its frames begin there; zero: at the port
};

/// Where the rod enters: nodes that have not passed the port lie on the straight line behind it.
struct RodPort {
    Vec3 position = Vec3::Zero();
    Vec3 direction = Vec3::UnitZ(); // unit, into the vessel
};

/// What holds the last segment, and so the tip's place and direction: a clamp at its middle, half a segment behind the tip. Of a rod that is
/// solved alone or beside others, neither in a bore nor with a wire in its own; it does not feel other rods or itself there.
struct RodClamp {
    Vec3 position = Vec3::Zero();   // m, of the tip at the end of the step
    Vec3 direction = Vec3::UnitX(); // unit, of the last segment, towards the tip
    Vec3 axis = Vec3::UnitY();      // unit, across it: first axis of the material there, of a rod with torsion
    bool slides = false;            // free along the direction
    bool spins = false;             // free to turn about it
};

/// Half-space on a point of the chain: weight[0] x_node + weight[1] x_node+1. The rod stays where
/// normal . point >= offset; a half-space that another place of the rod carries: where normal . (point - other point) >= offset. Its forces are those that the last solve ended with, and where the next one starts.
struct RodPlane {
    Index node = 0;      // 0 .. node_count - 2
    double weight = 0.0; // of node + 1, in [0, 1]
    Vec3 normal = Vec3::UnitX();
    double offset = 0.0;               // m
    double force = 0.0;                // N, set by the solve: normal force at its end
    Vec3 wall_velocity = Vec3::Zero(); // m/s, of what the rod slides on
    Vec3 drag = Vec3::Zero();          // N, set by the solve: friction that the rod feels; the wall feels the opposite
    double friction_share = 1.0;       // [-] of RodDrive::friction
    double start_force = 0.0;          // N, what the step began with: every solve of the step begins with it, by what drives the solver
    Vec3 start_drag = Vec3::Zero();    // N
    // Of a wall that gives way, the same for all planes of one side of a place: they move as one, by give (felt - sum of force normal).
    std::uint8_t side = 0;
    double give = 0.0;         // m/N; 0: it does not
    Vec3 felt = Vec3::Zero(); // N, that it pushes back with where it stands
    Index other = kNoIndex;            // the place that carries it is between this node and the next; kNoIndex: a wall carries it
    double other_weight = 0.0;         // of other + 1, in [0, 1]
};

/// A half-space of one rod that a place of another one carries: plane.other is a node of that one. Both feel the same force at the same place.
/// Or a place of a rod in the bore of another one, which stays within `play` of a point beside that one's place: |w| <= play, where w is the part
/// of (point + beside - other point) across `along`. The plane's normal is then -w / |w| where the solve ended, its offset -play.
struct RodMeeting {
    RodPlane plane;
    Index rod = 0, other_rod = 0; // SolvedRod::id; in a bore: the inner one, the outer one
    double play = 0.0;            // m; 0: a half-space
    Vec3 along = Vec3::UnitZ();   // unit, of the bore
    Vec3 beside = Vec3::Zero();   // m, of both rods' smooth curves from their chords
};

struct RodDrive {
    RodPort port;
    double insertion = 0.0; // m, at the end of the step
    double rotation = 0.0;  // rad, at the end of the step
    Vec3 gravity = Vec3::Zero();
    double contact_stiffness = 2000.0; // N/m, of what is behind the planes: a force presses it in by force / contact_stiffness
    double friction = 0.0;             // Coulomb mu
    std::span<const RodFlow> flow;     // [node_count] of the fluid around it; empty: none
    std::span<const Vec3> force = {};  // [node_count] N, constant over the step; empty: none
    RodTipLoad tip = {};
    std::optional<RodClamp> clamp = {}; // of the tip; none: it is free
    bool rough = false;                // to kRoughTolerance is enough: a look ahead that is solved again
};

/// What the solve keeps of a plane while it iterates: see rod_contact.hpp.
struct RodPress {
    double force = 0.0;         // N, multiplier: the normal force that the last stage ended with
    double last = 0.0;          // N, normal force of the last iteration
    double bounding = 0.0;      // N, normal force that bounds friction
    double stiffness = 0.0;     // N/m, of the forces as they were evaluated last
    Mat3 shared = Mat3::Zero(); // N/m, the same of a whole place of a wall that gives way: with its first plane that touches
    Vec3 given = Vec3::Zero();  // m, by which that has moved: with its first plane
    double gap = 0.0;           // m, where the iteration began
    bool pushes = false;        // it has a force or a stiffness, as they were evaluated last
    bool pushed = false;        // the same where the last correction started
    Vec3 anchor = Vec3::Zero(); // m, from where it is anchored to where it was at the stage's start
    Mat3 aside = Mat3::Zero();  // N/m, of friction
    Vec3 start_force = Vec3::Zero(); // N, N/m: where the last correction started
    Mat3 start_stiffness = Mat3::Zero(), start_shared = Mat3::Zero();
};

/// Planes of one place of the rod, or of one side of it where its wall gives way.
struct RodPlace {
    Index begin = 0, end = 0; // of RodNear
    Index node = 0, other = kNoIndex;
    double weight = 0.0, other_weight = 0.0; // as RodPlane has them
};

/// What of the planes the iteration can have met, and close together in memory what tells whether it pushes: nearly nothing of it does.
struct RodNear {
    std::vector<Index> planes;   // in their order
    std::vector<Vec3> normal;    // [planes]
    std::vector<double> offset;  // [planes] m
    std::vector<std::uint8_t> asleep; // [planes] they do not push, have not pushed and did not begin with a force
    std::vector<RodPlace> places;
    std::vector<Index> awake; // the others, and all that move as one with them; as they were evaluated last
};

/// What two places of the rod feel of each other's motion.
struct RodCoupling {
    Index node = 0, other = 0; // each place lies between this node and the next
    double weight = 0.0, other_weight = 0.0; // of the next
    Mat3 stiffness = Mat3::Zero(); // N/m
};

/// Memory of the solve: sized once, no allocation afterwards.
struct RodWorkspace {
    std::vector<Vec3> start, rest_bend, axis, tangent; // [node_count]
    std::vector<Vec3> from, from_velocity;             // [node_count] m, m/s; where a stage's motion is counted from: see rod.cpp
    std::vector<double> pace;                          // [node_count] s, that it lasts
    std::vector<Vec3> step_start, step_velocity;       // [node_count] m, m/s, at the sub-step's start
    std::vector<std::uint8_t> touched;                 // [node_count] a plane pressed on it in the last stage
    std::vector<Vec3> force;                           // [node_count] N; of masses and springs
    Vec3 tip_force = Vec3::Zero();                     // N, of RodDrive::tip in this stage
    double tip_torque = 0.0;                           // N m, the same
    std::vector<Vec3> binormal, edge;                  // [node_count] with torsion, as are the next: see rod_twist.cpp
    std::vector<double> before, after, writhe;         // [node_count] 1/m, 1/m, rad
    std::vector<double> start_angle;                   // [node_count] rad
    std::vector<double> diagonal, beside, turn;        // [node_count] of the angles' tridiagonal system
    std::vector<double> band;                          // [coordinates node_count][bandwidth + 1]
    std::vector<double> rhs, residual;                 // [coordinates node_count] N, or N m; rhs: the correction once it is solved, m or rad
    std::vector<RodPress> presses, self_presses;       // [planes] at least, [planes of the rod itself] at least
    RodNear near_planes, near_self;
    std::vector<double> remainder, guess, direction, banded, solution; // [coordinates node_count] of conjugate gradients
    std::vector<RodCoupling> couplings;                // of the places of the rod that press on one another
};

struct RodReport {
    unsigned iterations = 0;       // Newton iterations, all sub-steps together
    unsigned inner_iterations = 0; // conjugate gradients, where places of the rod press on one another
    double largest_residual = 0.0; // m, last Newton correction of the worst sub-step
    double farthest_m = 0.0;       // no node was farther from the step's start where planes were evaluated, in any iteration; a bound
    double force_error = 0.0;      // N, by which the worst contact force of the worst sub-step still changed
    unsigned unconverged = 0;      // sub-steps that ended at kMaxNewton
    double bend_j = 0.0;
    double stretch_j = 0.0;
    double twist_j = 0.0;
    double kinetic_j = 0.0;
    // At the end of the step. Their sum is what the iteration left over.
    Vec3 handle_force = Vec3::Zero();  // N, of what holds the nodes behind the port
    Vec3 contact_force = Vec3::Zero(); // N, of all planes
    Vec3 body_force = Vec3::Zero();    // N, weight, drag and other loads, less mass times acceleration
    double handle_torque = 0.0;        // N m about the port's axis; without torsion that of the rest curvature alone
    Vec3 clamp_force = Vec3::Zero();   // N, of what clamps the tip
    double clamp_torque = 0.0;         // N m about the clamp's axis
    Index first_bad_node = kNoIndex; // not finite
};

} // namespace trocar::fem
