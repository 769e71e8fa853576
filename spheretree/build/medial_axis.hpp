// Inscribed spheres of a closed surface: the input of a lumen tree.
//
// This work is based on: Ma, Bae, Choi 2012 (shrinking balls) and Peters & Ledoux 2016 (separation angle); see lumen_tree.hpp.
#pragma once

#include "base/inside.hpp"
#include "base/mesh.hpp"
#include "spheretree/sphere_tree.hpp"

namespace trocar::spheretree {

struct WallSample {
    Vec3 point = Vec3::Zero();   // m, on the wall
    Vec3 inward = Vec3::UnitX(); // unit, into the lumen
    double local_radius = 0.0;   // m, of the largest ball about: the lumen's width here, corners and roughness ignored
    double radius = 0.0;         // m, of the ball that touches here; 0: none was found
    double deficit = 0.0;        // m, from the sample to that ball: the part that the corners of the wall's facets make unreachable
};

struct MedialBalls {
    std::vector<WallSample> samples;
    std::vector<Sphere> balls; // inside the surface, free of it; up to 1 % smaller than they could be
};

struct SampleOptions {
    double min_radius = 1e-4;         // m, smaller balls are dropped
    double spacing = 0.4;             // of the local radius, between samples
    std::size_t max_samples = 60'000; // about; beyond it the spacing grows
};

/// wall  closed, oriented outwards
[[nodiscard]] MedialBalls find_medial_balls(const TriMesh& wall, const InsideTest& inside, const SampleOptions& options);

} // namespace trocar::spheretree
