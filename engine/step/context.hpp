// Scratch memory of the step: sized in the first steps, reused afterwards, worthless once the step has ended. What a step leaves for the
// next is in State.
#pragma once

#include "base/inside.hpp"
#include "collision/search/interruptible_search.hpp"
#include "engine/step/cull_stage.hpp"
#include "engine/step/report.hpp"
#include "engine/state/state.hpp"
#include "fem/rod/coaxial.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/stable_step.hpp"
#include "spheretree/traverse/descent.hpp"
#include "spheretree/traverse/sweep_and_prune.hpp"

#include <limits>
#include <optional>
#include <tuple>

namespace trocar::engine {

/// Coarse nodes that the spheres of a body hang on.
struct SphereNodes {
    std::vector<Index> begin;   // [sphere_count + 1]
    std::vector<Index> node;    // [entries]
    std::vector<double> weight; // [entries] sum of a sphere's: 1, less where its surface stands still
};

/// A touch of a vertex to which another side is nearer than the one it came by: its spring starts pressed by less than its depth.
struct PressedTouch {
    std::size_t touch = 0; // in SolidScratch::touches
    double pushed = 0.0;   // m
};

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
};

/// What a vertex meets of its own surface.
struct SelfNear {
    Index triangle = kNoIndex;
    double gap = 0.0; // m
    std::array<double, 3> bary{1.0, 0.0, 0.0};
    Vec3 normal = Vec3::UnitZ(), point = Vec3::Zero();
};

/// Contact between solid bodies.
struct SolidScratch {
    spheretree::SweepAndPrune sweep;
    Vec3 shared = Vec3::Zero();                // m, motion of this step that all solids may share; see find_common_motion
    std::vector<Vec3> drift;                   // [body_count] m/s, mean velocity at the step's end; 0 where something holds any body
    std::vector<Box3> boxes;                   // [body_count] of this step; empty: no solid that anything can touch
    std::vector<std::pair<Index, Index>> near; // bodies whose boxes overlap
    std::vector<LeafPair> leaf_pairs;
    std::vector<std::pair<Index, Index>> open_bodies; // with open sphere pairs, whose depth the surfaces decide
    std::vector<ProbedSphere> heap;
    std::vector<std::pair<Index, Index>> meeting;    // bodies, lower first, whose surfaces are looked at
    std::vector<SolidEntry> entries_before; // those of the last step, while this one lists its own
    std::vector<PressedTouch> pressed;
    std::vector<Index> self_vertices;            // of the body in hand that meet its own surface
    std::vector<Contact> touches;                // of this step: places of surfaces, with depth
    std::vector<SphereHold> holds_before; // the same of its holds
    std::vector<Piercing> piercings[2];
    std::vector<WarmStartSpring> vertex_springs_before; // and of its vertex springs
};

/// How old the bounds of a wall's tree are, where they are refitted part by part.
struct WallAge {
    static constexpr std::size_t kParts = 16; // a vertex's bounds are this many steps old at most, a cluster's twice as many
    std::array<double, 2 * kParts> moved{};   // m, longest way of a vertex in each of the last steps
    std::size_t parts = 0;                    // refitted since a refit of everything
    std::uint64_t last_step = kNoStep;        // State::step of the last refit; a step that was missed makes the rest worthless
    double drift = 0.0;                       // m, of any vertex from the bounds that hold it
    double longest = std::numeric_limits<double>::infinity(); // m, way of a vertex in this step; infinite where nobody has looked
};

struct BodyScratch {
    fem::TissueState tissue_t0;
    std::vector<Vec3> surface_t0; // [vertex_count] m
    bool may_wait = false;      // nothing can meet it: what a step does with its tissue needs none of its surface
    fem::RkWorkspace rk;
    fem::ContactSprings other_springs; // of those, what is not contact between solids: of a body whose solids' springs wait
    std::vector<double> spring_scale;  // [springs] scratch of the response
    bool springs_met = false;          // and one of them would be pressed: it is integrated again with them
    bool springs_deferred = false;         // it was integrated without its solids' springs: nothing touched it in the step
    fem::AdvanceReport advanced;       // its last integration
    std::vector<Vec3> pinned_target;
    std::vector<spheretree::Sphere> spheres;         // solid bodies, over the step
    spheretree::DeformingSpheres wrapped;            // the same, of solid bodies whose tree follows sphere by sphere
    std::vector<Mat3> turn_t0, turn_t1;              // [frame_count] A' - A of their links
    std::vector<spheretree::Sphere> self_spheres;    // the same, of bodies that touch themselves, as their own mean motion sees them
    std::vector<Vec3> surface_behind, surface_ahead; // [vertex_count] m, solid bodies: where they came from, and where they may go
    std::vector<Index> deepest;                      // [sphere_count] solid bodies, scratch of the response
    std::vector<Vec3> vertex_normal;                 // [vertex_count] area-weighted, solid bodies that touch, scratch of the response
    std::vector<std::uint8_t> vertex_seen;           // [vertex_count] solid bodies, scratch of the response
    std::vector<std::uint8_t> sphere_seen;           // [sphere_count] the same
    std::vector<Index> leaf_of_triangle;             // [triangle_count] solid bodies that are closed
    std::vector<SelfNear> self_near;                 // [vertex_count] bodies that touch themselves, scratch of the response
    bool surface_is_fresh = false;                   // inside, vertex_normal and motion are those of this step
    SurfaceTravel motion;                            // solid bodies that may touch
    Vec3 coming = Vec3::Zero();                      // m, where its path takes a kinematic one in the next step
    Vec3 change = Vec3::Zero();                      // m, by how much its next step is known to differ from this one
    double thickness = 0.0;                          // m, solid bodies that something can touch: extent along the thinnest axis, at rest
    SphereNodes sphere_nodes;                        // solid bodies that hang on nodes
    collision::DopTree tree;                         // hollow bodies, swept over the step
    WallAge wall_age;                                // of the tree
    std::vector<Vec3> flow_points;                   // [point_count] m, hollow bodies whose blood moves along with a carrier
    InsideTest inside; // hollow bodies: the independent check; closed solids: depths of contacts
};

struct InstrumentScratch {
    fem::RodState rod_t0;
    std::vector<Vec3> skin_t0;
    std::vector<Vec3> axis; // [node_count]
    fem::RodWorkspace rod;
    fem::RodReport rod_report;
    fem::CoaxialWorkspace coaxial; // with a wire inside
    DriveCommand command;
    std::vector<fem::RodFlow> flow; // [node_count] of the blood around it in this step
    std::vector<spheretree::Sphere> links_t0, links_t1;
    std::vector<double> wall_distance; // [2 node_count] m, at t0, at least; negative: not looked at; empty: nothing was, in this step
    collision::DopTree tree;           // of the skin, swept over the step
    ExactForecast forecast;
};

struct StepContext {
    std::vector<BodyScratch> bodies;
    std::vector<InstrumentScratch> instruments;
    spheretree::Descent descent;
    collision::InterruptibleSearch search;
    std::unique_ptr<CullStage> cull; // with instruments
    std::vector<Contact> coarse;     // of this step
    SolidScratch solids;
    std::vector<Contact> exact;    // of this step; the last round's
    std::vector<Contact> contacts; // what the response pushed against: what pictures and counts show
    StepReport report;
};

} // namespace trocar::engine
