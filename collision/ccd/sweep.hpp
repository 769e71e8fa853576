// Continuous elementary tests: does a vertex come within a distance of a triangle, or an edge of an edge, while all their
// vertices move linearly over a step? No false negatives: "Separated", and every safe time, is proven in floating point.
//
// Idea: at a time t take the shortest vector n between the two features. The differences q_i(t) of their corners (vertex minus
// each face corner; each end of a minus each end of b) move linearly, and what lies between the features is in their convex
// hull; so while n . q_i > distance |n| holds for every i the features are apart. That is an interval of time known in closed
// form for a given n: jump to its end, take the next n there. n needs no accuracy at all, only the interval's ends do; the
// proof of their rounding bound stands in separation.hpp. No cubic is solved.
// This work is based on: Mirtich, "Impulse-based dynamic simulation of rigid body systems" (1996), conservative advancement;
// Zhang, Redon, Lee, Kim, "Continuous collision detection for articulated models" (2007). Deviates: the bound on the motion is
// the exact linear motion along n of every corner, not a speed times a length, so most pairs are decided by one n.
#pragma once

#include "collision/ccd/features.hpp"

#include <array>
#include <cstdint>

namespace trocar::collision {

enum class SweepOutcome : std::uint8_t {
    Separated,      // proven: farther apart than the distance during the whole step
    Hit,            // farther apart at t0, within distance + tolerance at `time`
    StartsTouching, // within distance + tolerance at t0
    Unresolved,     // steps or digits ran out: treat as a hit at `time`; all times before are proven free
};

struct SweepLimits {
    double distance = 0.0;  // m, contact means no farther apart than this; >= 0
    double tolerance = 0.0; // m, pairs up to distance + tolerance may be reported as well; a larger one saves steps.
                            // 1e-13 of the features' extent comes on top, for rounding
    int max_steps = 256;    // advances before giving up as Unresolved; two or three are usual
};

struct Sweep {
    SweepOutcome outcome = SweepOutcome::Separated;
    double time = 1.0;      // [0, 1] where contact was found; every earlier time is proven farther apart than `distance`
    double safe_time = 1.0; // [time, 1] until here the features are proven not to touch: they keep kKeptGap of their smallest of
                            // `distance` and gap at `time`. 0 distance: equals `time`
    double gap = 0.0;       // m, distance at `time`
    std::array<double, 3> bary = {1.0, 0.0, 0.0}; // nearest points at `time`. Vertex-face: weights of the face's corners.
                                                  // Edge-edge: [0] the parameter along a, [1] along b, in [0, 1]
    Vec3 normal = Vec3::UnitX();                  // unit, from face to vertex, from b to a, at `time`

    [[nodiscard]] bool hit() const noexcept { return outcome != SweepOutcome::Separated; }
};

/// Share of the gap that a motion up to safe_time always leaves. Smaller lets things come closer in one step; 0 would let them
/// touch, and what touches cannot be told from what has passed.
inline constexpr double kKeptGap = 0.1; // [-]

/// Non-finite coordinates give Unresolved at time 0. Degenerate faces (a segment, a point) are answered as what is left of them.
[[nodiscard]] Sweep sweep_vertex_face(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face, const SweepLimits& limits) noexcept;
[[nodiscard]] Sweep sweep_edge_edge(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b,
                                    const SweepLimits& limits) noexcept;

} // namespace trocar::collision
