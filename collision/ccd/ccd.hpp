// Exact continuous tests: do a vertex and a triangle, or two edges, come into contact while their vertices move linearly over a step? Input
// is taken as the real numbers that its doubles are; the verdict has no tolerance. Four stages, each for what the one before
// could not decide; the first two take four pairs at a time:
// 1. one side of their plane at the start, or a few shortest vectors (sweep.hpp), prove most pairs apart, with a rounding bound;
// 2. crossing.hpp: they lie in one plane once, and are proven to meet there or not to;
// 3. ccd_fallback.hpp, the CCD fallback: the sweep advances to the contact; around that time the coplanarity polynomial changes sign by
//    more than its rounding, and the origin stays inside the corner differences' hull all that time;
// 4. the rest (touching at a corner or border, parallel, coplanar, degenerate, starting in contact) is decided in exact integer arithmetic.
// This work is based on: Brochu, Edwards, Bridson, "Efficient geometrically exact continuous collision detection" (2012), for asking
// exactly; deviates in how: roots of the coplanarity cubic are isolated, and signs of quadratics taken there, instead of counting
// crossings of a ray.
#pragma once

#include "collision/ccd/ccd_result.hpp"
#include "collision/ccd/features.hpp"
#include "collision/topology.hpp"

#include <array>
#include <span>

namespace trocar::collision {

/// Coordinates that are not finite leave the pair unresolved, which counts as a contact at time 0.
[[nodiscard]] CcdResult ccd_vertex_face(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face);
[[nodiscard]] CcdResult ccd_edge_edge(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b);

/// The same, bit for bit, for many pairs.
/// ccd_results   [pairs.size()] written; of those that do not meet only that counts
void ccd_vertex_faces(const SurfaceMotion& vertices, const SurfaceMotion& faces, std::span<const FeaturePair> pairs,
                       std::span<CcdResult> ccd_results);
void ccd_edge_edges(const SurfaceMotion& a, const SurfaceMotion& b, std::span<const FeaturePair> pairs, std::span<CcdResult> ccd_results);

} // namespace trocar::collision
