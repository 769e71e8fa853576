// How near two faces are, and whether they come nearer than a distance while their vertices move linearly over a step.
// source   closest points of triangles: Ericson, Real-Time Collision Detection (2005), sections 5.1.5, 5.1.9, 5.1.10: vertices against
//          faces, edges against edges, or where an edge passes through a face. Mezger, Kimmerle, Etzmuss 2003, section 6.1, use GJK, which
//          polygons of more corners need; for triangles the closed form is exact in fewer operations.
#pragma once

#include "collision/ccd/sweep.hpp"

namespace trocar::collision {

/// Closest points of two triangles by their weights of the corners.
struct FacePoints {
    double distance = 0.0; // m, 0 where they meet
    std::array<double, 3> bary_a{1.0, 0.0, 0.0}, bary_b{1.0, 0.0, 0.0};
};

using FaceCorners = std::array<Vec3, 3>;

/// Whether they meet is decided exactly, the distance otherwise to rounding. Degenerate triangles count as
/// the segment or point that is left of them.
[[nodiscard]] FacePoints closest_on_faces(const FaceCorners& a, const FaceCorners& b) noexcept;

struct SweptFace {
    FaceCorners t0, t1; // m
};

struct FaceProximity {
    FacePoints points; // at `time`
    double time = 0.0; // [0, 1] first time, of a pair that is as near at t0: 0
};

/// Pairs up to (1 + this) times the distance may be reported where the faces come near after t0; it saves the sweeps' last steps.
inline constexpr double kProximityTolerance = 1e-6; // [-]

/// Do the faces come as near as `distance`? At distance 0 the verdict is exact: do they meet? At others rounding may add pairs that are
/// 1e-13 of the faces' extent farther, and loses none.
/// distance      m, >= 0
/// during_step   false: at t0 alone
[[nodiscard]] bool find_face_proximity(const SweptFace& a, const SweptFace& b, double distance, bool during_step, FaceProximity& out);

/// The baseline that misses: the vertices of one against the face of the other alone.
/// both   also the vertices of a against the face of b
[[nodiscard]] bool find_vertex_proximity(const SweptFace& a, const SweptFace& b, double distance, bool during_step, bool both,
                                         FaceProximity& out);

} // namespace trocar::collision
