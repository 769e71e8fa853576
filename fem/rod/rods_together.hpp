// Rods that press on one another, solved together: one Newton iteration over all of them, so that both sides of a place feel the same force.
//
// Each rod's band is factorised as if it were alone, with what it feels of its own motion where others press on it. What it feels of
// theirs couples the bands: conjugate gradients with the bands as preconditioner (conjugate_gradients.hpp). Rods in bores that press are
// one matrix (joint_band.hpp). Search and convergence are of all rods at once. docs/contact.md, "Two rods".
#pragma once

#include "fem/rod/rod_part.hpp"
#include "fem/rod/rod_solver.hpp"
#include "fem/rod/rod_stages.hpp"

#include <array>
#include <optional>
#include <vector>

namespace trocar::fem {

/// Rods that one solve takes at most.
inline constexpr std::size_t kMostTogether = 8;

/// One rod of the solve, its stage and the step of that.
struct RodOfMany {
    std::optional<RodStages> stages;
    std::optional<RodPartOf<kRodCoordinates>> untwisted;
    std::optional<RodPartOf<kTwistedCoordinates>> twisted;

    [[nodiscard]] RodPart& part() noexcept {
        if (twisted) return *twisted;
        return *untwisted;
    }
};

/// A force of a meeting on both rods, opposite on the second.
struct MeetingLoad {
    SurfacePlace place[2]; // on the rod that keeps to the plane, on the one that carries it
    Vec3 start_force = Vec3::Zero();     // N, where the last correction started
    Mat3 start_stiffness = Mat3::Zero(); // N/m
};

/// What the solve keeps of a meeting while it iterates.
struct MeetingPress {
    RodPress press;
    std::array<MeetingLoad, 2> load; // of both surfaces where they touch; in a bore what presses is on the axes, which it turns about
    std::size_t loads = 1;
    Mat3 turning = Mat3::Zero(); // N/m, of a force that turns with its place in a bore
    Index part[2] = {0, 0};  // of the rods of this solve
    double across = 0.0;     // N/m, augmentation
    double softness = 0.0;   // m/N, of what lies between
    double friction = 0.0;   // Coulomb mu
};

/// Memory of the solve: sized once, no allocation afterwards.
struct TogetherWorkspace {
    std::array<RodOfMany, kMostTogether> rods;
    RodWorkspace all; // rhs, residual and what conjugate gradients want, of all coordinates
    std::vector<MeetingPress> presses;
    JointBand joint; // of rods in bores
    std::vector<JointBand::Node> nodes;
};

/// nodes      of all rods together
/// segments   [-] the longest segment over the shortest, of rods in one another's bores
void reserve_together(std::size_t nodes, std::size_t meetings, double segments, TogetherWorkspace& workspace);

/// Advances all of them by `step` seconds, as solve_rod would each alone where no meeting presses.
/// rods       at most kMostTogether, without wires
/// meetings   of those; forces are filled in. Friction is the geometric mean of both rods'
/// fails      never; a state that is not finite is reported by node
void solve_together(std::span<const SolvedRod> rods, std::span<RodMeeting> meetings, double step, TogetherWorkspace& workspace) noexcept;

} // namespace trocar::fem
