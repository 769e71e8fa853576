// The lumen of a hollow body as a union of inscribed spheres. A tree of spheres around the wall would fill the vessel and collide
// with everything inside; the lumen's inscribed spheres are free space: an instrument sphere inside one of them touches nothing,
// and its wall depth is how far it reaches out of their union.
//
// This work is based on:
//   Ma, Bae, Choi 2012, "3D medial axis point approximation using nearest neighbors and the normal field" (shrinking balls).
//   Peters & Ledoux 2016, "Robust approximation of the medial axis transform of LiDAR point clouds" (separation angle).
// Deviates: balls shrink against the triangles themselves, not against samples, and are then grown towards the medial axis;
// every ball's radius is the exact distance of its centre to the wall. A greedy cover picks the few that matter.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "spheretree/sphere_tree.hpp"

namespace trocar::spheretree {

struct LumenOptions {
    double relative_error = 0.04;     // of the local radius: depth at which a wall sample may lie outside the union of the balls
    double error_floor = 2e-5;        // m; finer detail of the wall than this is not followed
    double corner_ratio = 0.25;       // of the local radius: corners that only smaller balls reach are left to the exact stage
    double min_radius = 1e-4;         // m; narrower lumen is treated as closed. Half the instrument's radius is enough
    double link_reach = 0.15;         // of a ball's radius: wall triangles within that much beyond it move it
    unsigned branching = 8;           // 2, 4 or 8 children at most
    std::size_t max_samples = 60'000; // of the wall, about; a larger or finer lumen is sampled more sparsely
};

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

/// What was reached, for the build's report.
struct LumenReport {
    std::size_t samples = 0, candidates = 0, balls = 0;
    std::size_t components = 0;      // of the union of the balls; 1: every part can be reached from every other
    double worst_relative_error = 0; // over the samples: distance to the union / local radius
    double mean_relative_error = 0;
};

/// closed_lumen  closed, oriented outwards (free space inside), without self-intersections: a wall inside the lumen is a wall
/// fails     BadMesh: open, inward, empty, or narrower than min_radius everywhere
/// cost      seconds for 60K triangles; offline
[[nodiscard]] Result<LumenTree> build_lumen_tree(const TriMesh& closed_lumen, const LumenOptions& options = {},
                                                 LumenReport* report = nullptr);

} // namespace trocar::spheretree
