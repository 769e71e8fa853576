// Scratch of contact between solid bodies: sized in the first steps, reused afterwards, worthless once the step has ended.
#pragma once

#include "base/inside.hpp"
#include "engine/state/state.hpp"
#include "engine/step/solid/normal_cone.hpp"
#include "spheretree/traverse/descent.hpp"
#include "spheretree/traverse/sweep_and_prune.hpp"

#include <optional>
#include <span>

namespace trocar::engine {

/// How far a surface goes in a step.
struct SurfaceTravel {
    Vec3 mean = Vec3::Zero(); // m
    double spread = 0.0;      // m, no vertex moves by more from the mean
    double farthest = 0.0;    // m, nor by more in all
};

/// A sphere of one body and what its distance to another body's surface promises.
struct ProbedSphere {
    double bound = 0.0;                    // m, no place beneath lies deeper
    Index sphere = 0, triangle = kNoIndex; // of the other body, nearest to the sphere's centre
};

/// An edge passes through a triangle of the other body.
struct Piercing {
    Index v0 = 0, v1 = 0; // v0 < v1
    double s = 0.0;       // [0, 1] from v0
    Index face = 0;
};

/// A face of the other body near the leaf in hand.
struct NearFace {
    Box3 box; // m
    Index face = 0;
};

/// Edges of a closed body's surface that are convex and sharp, beneath each leaf that has a face of theirs (edge_touch.hpp).
struct SharpEdges {
    std::vector<Index> leaf_begin;      // [sphere_count + 1]
    std::vector<Index> edge;            // of the topology, by leaf, ascending
    std::vector<std::uint8_t> is_sharp; // [edge_count]
    std::size_t count = 0;

    [[nodiscard]] bool has(Index e) const { return e != kNoIndex && !is_sharp.empty() && is_sharp[e] != 0; }
    [[nodiscard]] std::span<const Index> beneath(Index leaf) const {
        if (count == 0) return {};
        return std::span(edge).subspan(leaf_begin[leaf], leaf_begin[leaf + 1] - leaf_begin[leaf]);
    }
};

/// What a vertex meets of its own surface.
struct SelfNear {
    Index triangle = kNoIndex;
    double gap = 0.0; // m
    std::array<double, 3> bary{1.0, 0.0, 0.0};
    Vec3 normal = Vec3::UnitZ(), point = Vec3::Zero();
};

struct SolidBodyScratch {
    std::span<const Vec3> surface_t0, nodes_t0;      // [vertex_count], [node_count] m, at the start of the step: views of BodyStart
    std::vector<spheretree::Sphere> spheres;         // over the step
    spheretree::DeformingSpheres wrapped;            // the same, of bodies whose tree follows sphere by sphere
    std::vector<Mat3> turn_t0, turn_t1;              // [frame_count] A' - A of their links
    std::vector<spheretree::Sphere> self_spheres;    // as `spheres`, of bodies that touch themselves, as their own mean motion sees them
    std::vector<Vec3> surface_behind, surface_ahead; // [vertex_count] m, where they came from, and where they may go
    std::vector<Index> deepest;                      // [sphere_count]
    std::vector<std::uint8_t> vertex_seen;           // [vertex_count]
    std::vector<std::uint8_t> sphere_seen;           // [sphere_count] 1: its surface was granted, 2: its edges were looked at
    std::vector<Index> leaf_of_triangle;             // [triangle_count] of closed bodies
    std::vector<SelfNear> self_near;                 // [vertex_count] of bodies that touch themselves
    bool surface_is_fresh = false;                   // inside and motion are those of this step
    SurfaceTravel motion;                            // of those that may touch
    Vec3 coming = Vec3::Zero();                      // m, where its path takes a kinematic one in the next step
    Vec3 change = Vec3::Zero();                      // m, by how much its next step is known to differ from this one
    Vec3 fall = Vec3::Zero();                        // m, of this, what gravity does: as far as nothing carries it
    double thickness = 0.0;                          // m, of those that something can touch: extent along the thinnest axis, at rest
    InsideTest inside;                               // of closed ones: depths of contacts
    SurfaceAdjacency adjacency;                      // of the same
    SharpEdges sharp;                                // of the same
};

/// Of a SolidContact.
struct SolidForce {
    Vec3 force = Vec3::Zero(), warm = Vec3::Zero(); // N
};

struct SolidScratch {
    std::vector<SolidBodyScratch> bodies;      // [body_count]
    std::span<const Contact> coarse;           // of this step's traversal
    spheretree::SweepAndPrune sweep;
    Vec3 shared = Vec3::Zero();                // m, motion of this step that all solids may share; see find_common_motion
    std::vector<Box3> boxes;                   // [body_count] of this step; empty: no solid that anything can touch
    std::vector<std::pair<Index, Index>> near; // bodies whose boxes overlap
    std::vector<LeafPair> leaf_pairs;
    std::vector<std::pair<Index, Index>> open_bodies; // with open sphere pairs, whose depth the surfaces decide
    std::vector<ProbedSphere> heap;
    std::vector<std::pair<Index, Index>> meeting; // bodies, lower first, whose surfaces are looked at
    std::vector<SolidEntry> entries_before;       // those of the last step, while this one lists its own
    std::vector<std::size_t> pressed;             // in touches: to whose vertex another side is nearer than the one it came by; edges that crossed deep
    std::vector<Index> self_vertices;     // of the body in hand that meet its own surface
    std::vector<Contact> touches;         // of this step: places of surfaces, with depth
    std::vector<Piercing> piercings[2];
    std::vector<NearFace> near_faces;          // of the leaf in hand
    std::optional<Vec3> nearest;               // m, of the other body's surface to the last vertex that was tested there
    std::vector<Box3> edge_boxes;              // of the leaf in hand
    std::vector<SolidContact> contacts_before; // and of its places
    std::vector<SolidForce> forces_t0;         // [contacts] of the state's, at the start of the step: for one that fails
    std::vector<LeafPair> touching_before;     // and of its leaf pairs
    std::vector<std::uint8_t> looked;          // [meeting] the surfaces of these two are looked at in this step
    std::vector<std::uint8_t> touched;         // [meeting] the two touched in the last step
    std::vector<std::uint8_t> counted;         // [body_count] of a forecast
    std::vector<LeafPair> waiting, batch;      // of two bodies: those that touched in the last step first; those in hand
    std::vector<std::size_t> begin_of;         // of a counting sort
    std::vector<LeafPair> done_pairs;          // by key: whose surfaces were looked at
    std::vector<LeafPair> left_pairs;          // by key: the others
    std::vector<Contact> sphere_places;        // where spheres push for want of a surface's depth
    std::vector<Contact> wholes;               // two bodies each that are held as wholes
    std::vector<Index> held;                   // of coarse: pairs of spheres that hold for what was left
    std::vector<std::pair<Index, Index>> left_bodies; // pairs of bodies with anything that the budget left, by index
};

} // namespace trocar::engine
