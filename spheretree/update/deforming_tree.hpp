// A wrapped tree that follows a deforming body through its coarse nodes, sphere by sphere as a descent asks for them: an
// interrupted traversal never pays for the rest.
//
// This work is based on: Mendoza & O'Sullivan 2005, section 4 (spheres linked to their nearest coarse vertices), James & Pai 2004,
// "BD-Tree" (bounds from what moves the surface). Deviates: `Conservative` turns a sphere with its nodes, so that a rigid motion
// costs nothing, and grows it by what the nodes beneath do otherwise; nothing of the surface can leave it.
#pragma once

#include "base/mesh.hpp"
#include "spheretree/sphere_tree.hpp"

#include <array>

namespace trocar::spheretree {

enum class SphereUpdate : std::uint8_t {
    Conservative, // holds what it held at rest, whatever the nodes do
    Heuristic,    // the sphere-tree paper's: centre + mean displacement of V, radius times max |c' - q'| / |c - q|. It may lose surface
};

/// How the dense surface is embedded in coarse nodes: vertex = sum a_i q_i + A rho of its frame, or a blend of that and its rest
/// place. The spans belong to the links' owner; weights a_i are not negative and sum to one.
struct SurfaceLinks {
    std::span<const Triangle> frame_nodes;   // [triangle_count] coarse node ids
    std::span<const Mat3> frame_rest;        // [triangle_count] A, orthonormal columns
    std::span<const Index> vertex_frame;     // [vertex_count] kNoIndex: the vertex stands still
    std::span<const Vec3> vertex_projection; // [vertex_count] m, rho
    std::span<const double> vertex_blend;    // [vertex_count] 1: moves fully, 0: stands still
    std::span<const Vec3> node_rest;         // [node_count] m
    // frames after the triangles': vertex = sum w_i q_i of four nodes, weights of any sign that sum to one
    std::span<const Tet> affine_nodes = {};                    // [affine_count]
    std::span<const std::array<double, 4>> affine_weight = {}; // [affine_count]
};

/// Where the nodes are, and how far each frame has turned.
struct NodePose {
    std::span<const Vec3> position; // [node_count] m
    std::span<const Mat3> turn;     // [frame_count] A' - A
};

/// Built once, then only read.
struct DeformingTree {
    SphereTree tree;                   // as it was wrapped at rest; items: triangle ids
    std::vector<Mat3> frame_rest;      // [triangle_count]
    std::vector<Triangle> frame_nodes; // [triangle_count]
    std::vector<Tet> affine_nodes;     // [affine_count] of tetrahedra: frames after those
    std::vector<double> affine_reach;  // [affine_count] sum |w|: how far the vertex goes where no node goes farther than 1
    std::vector<Vec3> node_rest;       // [node_count] m
    std::vector<Index> near_begin;     // [sphere_count + 1] V: the coarse nodes nearest to the centre
    std::vector<Index> near;
    std::vector<Triangle> turners; // [sphere_count] three nodes far apart that turn the sphere; kNoIndex: there are none
    struct Beneath {
        Index frame;
        double reach; // m, longest |rho| of the vertices beneath that are embedded in it
    };
    std::vector<Index> beneath_begin; // [sphere_count + 1] frames that carry what lies beneath
    std::vector<Beneath> beneath;
    // [sphere_count] m, 0: nothing beneath stands still; else above 0, and at least the radius and the distance from the centre of every
    // vertex of the triangles beneath that stands still, wholly or in part
    std::vector<double> stands;
};

/// |V| by level, the root's first; deeper levels as the last. More of them: smoother and slower.
inline constexpr std::array<unsigned, 4> kNearestNodes = {32, 16, 12, 8};

/// tree, surface   the wrapped tree of the surface, and its triangles      links   of the surface's vertices
[[nodiscard]] DeformingTree make_deforming_tree(SphereTree tree, const TriMesh& surface, const SurfaceLinks& links,
                                                std::span<const unsigned> nearest = kNearestNodes);

/// One sphere in one pose. Heuristic: nodes of V that lie on the centre say nothing about the radius and are passed over.
/// cost   Conservative: O(frames beneath); Heuristic: O(|V|)
[[nodiscard]] Sphere deform_sphere(const DeformingTree& tree, Index sphere, const NodePose& pose, SphereUpdate update) noexcept;

/// Spheres that are evaluated lazily.
class LazySpheres {
public:
    virtual ~LazySpheres() = default;
    /// Makes spheres [first, first + count) those of this step.
    virtual void ensure(Index first, Index count) noexcept = 0;
};

/// Of one body in one step. Reused every step: allocates in the first one only.
class DeformingSpheres final : public LazySpheres {
public:
    /// Forgets all spheres. They are to hold their surface from pose_t0 to pose_t1 and on the straight ways between (Heuristic: to
    /// hold the spheres of both); without pose_t0 at one instant. The tree and the poses are read until the next begin.
    /// reach  m, all spheres grow by this: how far the surface may have moved since
    void begin(const DeformingTree& tree, SphereUpdate update, const NodePose& pose_t1, const NodePose& pose_t0 = {}, double reach = 0.0);
    void ensure(Index first, Index count) noexcept override;
    [[nodiscard]] std::span<const Sphere> spheres() const noexcept { return spheres_; } // [sphere_count] those ensured are valid
    [[nodiscard]] bool knows(Index sphere) const noexcept { return known_[sphere] == step_; }
    [[nodiscard]] std::uint64_t updated() const noexcept { return updated_; } // in this step

private:
    const DeformingTree* tree_ = nullptr;
    SphereUpdate update_ = SphereUpdate::Conservative;
    NodePose t0_, t1_;
    double reach_ = 0.0;
    std::vector<Sphere> spheres_;
    std::vector<std::uint32_t> known_; // [sphere_count] step in which the sphere was found
    std::uint32_t step_ = 0;
    std::uint64_t updated_ = 0;
};

} // namespace trocar::spheretree
