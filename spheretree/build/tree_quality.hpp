// Quality of a sphere tree: how far it reaches outside, what it leaves uncovered, what a descent reaches.
#pragma once

#include "base/inside.hpp"
#include "base/mesh.hpp"
#include "spheretree/sphere_tree.hpp"

namespace trocar::spheretree {

struct LevelQuality {
    std::size_t count = 0;     // spheres that are not empty
    double outside_max = 0.0;  // m, farthest that any sphere reaches outside the surface
    double outside_mean = 0.0; // m, mean over the spheres of the farthest that each reaches
    double uncovered = 0.0;    // share of the area that no sphere of the level is known to hold, 0..1
    double reachable = 0.0;    // share of the area reached through spheres that hold it, from the root to this level, 0..1
};

struct TreeQuality {
    std::vector<LevelQuality> levels; // [level_count], the root's first
    double volume_ratio = 0.0;        // union of the leaves over the body; 0 for a surface without an inside
};

struct QualityOptions {
    /// Triangles are cut until a part lies in one sphere, or is shorter than this share of the longest box edge and counts as
    /// uncovered: the answer is a bound, not an estimate.
    double finest = 1e-4;
    unsigned directions = 128; // places sampled on every sphere, beside the one farthest from the surface by the bound
    unsigned lines = 256;      // the union's volume is summed along lines x lines rays
};

/// Any tree over the surface, also one from a file: nothing is taken from the builder. Where the surface has no inside
/// (solid false) a sphere reaches as far as the farthest place on it lies from the surface.
[[nodiscard]] TreeQuality measure_quality(const SphereTree& tree, const TriMesh& surface, bool solid, const QualityOptions& options = {});

/// Volume of the union of balls, along lines * lines rays. m^3
[[nodiscard]] double union_volume(std::span<const Sphere> balls, unsigned lines);

} // namespace trocar::spheretree
