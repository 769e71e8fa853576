// The lumen of a hollow body as a union of inscribed spheres. A tree of spheres around the wall would fill the vessel and collide
// with everything inside; the lumen's inscribed spheres are free space: an instrument sphere inside one of them touches nothing,
// and its wall depth is how far it reaches out of their union.
#pragma once

#include "base/vec.hpp"
#include "spheretree/sphere_tree.hpp"

#include <span>
#include <vector>

namespace trocar::spheretree {

/// Item k of the tree is ball k; leaf balls are numbered in depth-first order, one per leaf. Inner spheres bound the balls
/// beneath, so they bound how good any ball beneath can be.
struct LumenTree {
    SphereTree tree;
    std::vector<double> largest_ball;   // [sphere_count] m, largest ball radius beneath
    std::vector<Index> leaf_of_ball;    // [ball_count] sphere id
    std::vector<Index> neighbour_begin; // [ball_count + 1]
    std::vector<Index> neighbours;      // balls that overlap this one, ascending
    std::vector<Index> wall_begin;      // [ball_count + 1]
    std::vector<Index> wall_triangles;  // wall triangles within reach of the ball at rest, ascending
    std::vector<Index> anchor_begin;    // [ball_count + 1]
    std::vector<Index> anchors;         // few wall vertices spread around the ball: its centre follows them
    std::vector<double> anchor_weights; // sum 1, and sum of weight * rest vertex = the ball's centre: rigid turns are exact
    double link_reach = 0.0;            // [-] LumenOptions::link_reach it was built with
    std::vector<Vec3> rest_vertices;    // [vertex_count] m, of the wall
    std::vector<Triangle> triangles;    // [triangle_count] of the wall

    [[nodiscard]] std::size_t ball_count() const noexcept { return leaf_of_ball.size(); }
    [[nodiscard]] Index ball_of_leaf(Index leaf) const noexcept { return tree.item_begin[leaf]; }
    [[nodiscard]] const Sphere& ball(Index ball) const noexcept { return tree.spheres[leaf_of_ball[ball]]; }
    [[nodiscard]] std::span<const Index> neighbours_of(Index ball) const noexcept {
        return std::span(neighbours).subspan(neighbour_begin[ball], neighbour_begin[ball + 1] - neighbour_begin[ball]);
    }
    [[nodiscard]] std::span<const Index> wall_of(Index ball) const noexcept {
        return std::span(wall_triangles).subspan(wall_begin[ball], wall_begin[ball + 1] - wall_begin[ball]);
    }
};

} // namespace trocar::spheretree
