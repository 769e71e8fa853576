// The catheter's way to a target along the centreline, and what makes it hard: length, narrowest place, sharpest bend.
#pragma once

#include "assets/anatomy/anatomy.hpp"

namespace trocar::anatomy {

struct Route {
    std::vector<Vec3> points;  // m, from femoral_entry to the target
    std::vector<double> radii; // m, of the lumen around them
};

struct RouteReport {
    std::string target;
    double length = 0.0;               // m
    double straight_distance = 0.0;    // m
    double min_radius = 0.0;           // m
    double min_curvature_radius = 0.0; // m, over a window of about a vessel's radius
    double total_turn = 0.0;           // rad, sum of the bends
    int forks = 0;                     // branches changed on the way
};

/// BadValue, with the known names, for a target that is no landmark.
[[nodiscard]] Result<Route> find_route(const Anatomy& anatomy, std::string_view target);

[[nodiscard]] Result<RouteReport> inspect_route(const Anatomy& anatomy, std::string_view target);

/// A readable table: sizes of both surfaces, extents, and one line per target. Lengths in mm.
[[nodiscard]] std::string summarise(const Anatomy& anatomy);

} // namespace trocar::anatomy
