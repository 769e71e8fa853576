// Route through a lumen, from inscribed sphere to overlapping sphere: the path an instrument can be driven along to its target.
#pragma once

#include "base/result.hpp"
#include "spheretree/lumen/lumen_tree.hpp"

namespace trocar::spheretree {

struct LumenPathPoint {
    Vec3 centre = Vec3::Zero(); // m
    double radius = 0.0;        // m, clearance around the centre; a lower bound
};

struct PathOptions {
    double min_radius = 0.0; // m, never narrower than this
    double spacing = 1e-3;   // m, of the points that are returned
    unsigned smoothing = 20; // rounds of averaging; a point never moves to where it is narrower than it was, unless
                             // it keeps 90 % of its clearance; 0: the spheres' centres as they are
};

/// Widest-and-shortest route: minimises the sum of length / clearance (Dijkstra over overlapping spheres; ties by id).
/// from, to  m, inside the lumen, or at most one ball radius outside it
/// returns   points from `from` to `to`, about `spacing` apart
/// fails     BadValue: an end lies outside the lumen, no route is as wide as min_radius (the error says the widest there is)
[[nodiscard]] Result<std::vector<LumenPathPoint>> find_lumen_path(const LumenTree& lumen, const Vec3& from, const Vec3& to,
                                                                  const PathOptions& options = {});

/// m, length of the shortest way from `from` to every ball's centre, from ball to overlapping ball; infinite where there is none.
/// fails     BadValue: `from` lies outside the lumen
[[nodiscard]] Result<std::vector<double>> find_way_lengths(const LumenTree& lumen, const Vec3& from);

/// Clearance of a point: radius of the largest inscribed sphere around it that the union proves; negative: distance to the
/// union. Rest pose.
[[nodiscard]] double free_radius_at(const LumenTree& lumen, const Vec3& p);

} // namespace trocar::spheretree
