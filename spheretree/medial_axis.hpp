// Free balls inside a closed surface: the raw material of a lumen tree.
//
// This work is based on: Ma, Bae, Choi 2012 (shrinking balls) and Peters & Ledoux 2016 (separation angle); see lumen_tree.hpp.
#pragma once

#include "base/inside.hpp"
#include "base/mesh.hpp"
#include "spheretree/sphere_tree.hpp"

namespace seldinger::spheretree {

struct WallSample {
    Vec3 point = Vec3::Zero();  // m, on the wall
    Vec3 inward = Vec3::UnitX(); // unit, into the lumen
    double radius = 0.0;        // m, of the ball that touches here; 0: none was found
    double deficit = 0.0;       // m, from the sample to that ball: what the wall's facets hide in their corners
};

struct MedialBalls {
    std::vector<WallSample> samples;
    std::vector<Sphere> balls;        // inside the surface; radius = exact distance of the centre to it
};

/// Samples every vertex and every triangle, large triangles (against the local radius) several times.
/// wall  closed, oriented outwards     min_radius  m, smaller balls are dropped
/// max_samples  beyond it triangles are left out evenly, then vertices
[[nodiscard]] MedialBalls find_medial_balls(const TriMesh& wall, const InsideTest& inside, double min_radius,
                                            std::size_t max_samples);

} // namespace seldinger::spheretree
