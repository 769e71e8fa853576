// Torsion of the rod: one material angle per node, solved beside the positions in every Newton iteration, in linear time.
//
// This work is based on:
//   Bergou, Wardetzky, Robinson, Audoly, Grinspun 2008, "Discrete Elastic Rods" (angles on a frame carried without twist).
//   Bergou, Audoly, Vouga, Wardetzky, Grinspun 2010, "Discrete Viscous Threads" (gradient and second derivatives of the twist at a node).
// Deviations: angles sit at the nodes, where the rest curvature acts, not on the segments; positions and angles alternate,
// each least in energy for the other. In a sub-step the frames are parallel-transported in time: bending has twisted the rod at a node by
// the area that its two segments' directions sweep on the sphere, and the gradient is that where the rod is. Then the angles are counted
// from frames transported along the rod again. The second derivatives are left out where the rod would buckle, and where the torque is small.
#pragma once

#include "fem/rod/rod_model.hpp"

#include <array>

namespace trocar::fem {

/// rad; no angle turns further in one Newton iteration: a tip that snaps round goes through all angles on its way.
inline constexpr double kTrustAngle = 0.5;

/// Second derivatives of the twist at a node by its segments, 1/m^2, made symmetric.
struct TwistCurl {
    Mat3 before, after, across; // by the segment before it twice, by that after it twice; rows by that before, columns by that after
};

/// The angles' part of one implicit Euler step. Nodes before `first` have the handle's angle: it is turned at the port.
class RodTwist {
public:
    RodTwist(const RodModel& model, RodState& state, const RodDrive& drive, double dt, Index first, RodWorkspace& workspace) noexcept
        : model_(model), state_(state), drive_(drive), dt_(dt), first_(first), work_(workspace) {}

    /// Frames of the sub-step, gradient of the twist, first guess of the angles; keeps where the nodes start.
    void begin() noexcept;

    /// How far bending has twisted the rod in this sub-step, and its gradient, at the current positions.
    void find_writhe() noexcept;

    /// How bending node i twists the rod: gradient for nodes i - 1, i, i + 1, 1/m.
    [[nodiscard]] std::array<Vec3, 3> gradient(std::size_t i) const noexcept;
    /// Of node i, not a fold.
    [[nodiscard]] TwistCurl curl(std::size_t i) const noexcept;
    /// N m, twisting torque at node i; N m/rad, how it grows at most.
    [[nodiscard]] double torque_at(std::size_t i) const noexcept;
    [[nodiscard]] double stiffness_at(std::size_t i) const noexcept;

    /// Rows of the angles' Newton iteration, after find_writhe, without contact: work.turn N m, work.diagonal and work.beside N m/rad.
    void assemble() noexcept;
    /// The tip's angle is the clamp's, whatever its row says: call it where something has been added to the rows.
    void hold_tip() noexcept;
    /// Turns one node by `by` rad, with its rest curvature.
    void turn_node(std::size_t node, double by) noexcept;
    /// Solves those rows and turns the nodes.
    void solve_rows() noexcept;

    /// Rates of the angles over the sub-step; then counts them from the frames of the new positions.
    void end() noexcept;

    /// N m, in the segment behind node `first`, which moves: what the node feels of the handle, less that it is of opposite sign.
    [[nodiscard]] double torque_behind(Index first) const noexcept { return torque(first - 1); }

    /// J, of the segments beyond the port
    [[nodiscard]] double energy() const noexcept;

private:
    /// N m/rad between nodes i and i + 1: the part behind the port does not twist.
    [[nodiscard]] double stiffness(std::size_t i) const noexcept;
    [[nodiscard]] double torque(std::size_t i) const noexcept;
    /// rad, by which bending has twisted it in this stage: half of what either node has; the handle's does not turn with it.
    [[nodiscard]] double bent(std::size_t i) const noexcept;
    void carry_frames() noexcept;
    void turn_rest_bend(std::size_t i) noexcept;
    void recount_angles() noexcept;
    void assemble_row(std::size_t i) noexcept;

    const RodModel& model_;
    RodState& state_;
    const RodDrive& drive_;
    double dt_;
    Index first_;
    RodWorkspace& work_;
};

/// Allocates for the angles; nothing without torsion.
void size_twist_workspace(const RodModel& model, RodWorkspace& workspace);

} // namespace trocar::fem
