// Few balls out of many: the greedy set cover of the wall samples.
#pragma once

#include "spheretree/build/medial_axis.hpp"

namespace trocar::spheretree {

struct CoverLimits {
    double relative_error = 0.04; // of the local radius, or of twice the sample's own ball where that is less
    double error_floor = 2e-5;    // m
    double corner_ratio = 0.25;   // samples whose own ball is smaller than this share of the local radius sit in a corner
                                  // and need not be covered
};

/// Ids of balls such that every sample that has a ball of its own and is in no corner lies within its limit of a chosen
/// ball, and that balls which overlap a common candidate are connected. Largest gain first; ties: larger ball, lower id.
/// source   Chvatal 1979, "A greedy heuristic for the set-covering problem", evaluated lazily (Minoux 1978)
[[nodiscard]] std::vector<Index> select_cover(const MedialBalls& medial, const CoverLimits& limits);

/// Component of each ball under overlap deeper than a tenth of the smaller ball, numbered from 0 in order of first ball.
[[nodiscard]] std::vector<Index> find_components(std::span<const Sphere> balls, std::size_t& count);

} // namespace trocar::spheretree
