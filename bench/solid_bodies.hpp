// Bodies of the sphere-tree tables: scans from the test data, generated ones where there is none, each with its tree.
#pragma once

#include "base/result.hpp"
#include "bench/bench_table.hpp"
#include "spheretree/traverse/descent.hpp"
#include "spheretree/build/wrapped_tree.hpp"

namespace trocar::engine {

struct SolidBody {
    std::string name;
    TriMesh mesh; // m
    spheretree::SphereTree tree;
    std::string builder;
    double build_s = 0.0, build_cpu_s = 0.0; // s, by the clock and of all threads
};

/// A rigid placement: turned about y through its own middle, then moved.
struct Pose {
    double angle = 0.0;        // rad
    Vec3 shift = Vec3::Zero(); // m
};

/// A body where it stands in one step.
struct PlacedBody {
    TriMesh mesh;
    std::vector<spheretree::Sphere> spheres;
};
[[nodiscard]] PlacedBody place(const SolidBody& body, const Pose& pose);

/// Dragon and bunny where the test data has them, else a torus and a dented ball. The medial builder where the surface allows
/// it, the shell's otherwise: the body says which.
[[nodiscard]] Result<std::vector<SolidBody>> make_dragon_and_bunny(const BenchOptions& options);

/// Builds the tree, timed in CPU seconds.
[[nodiscard]] Result<SolidBody> make_solid_body(std::string name, TriMesh mesh, spheretree::Builder builder);

} // namespace trocar::engine
