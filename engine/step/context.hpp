// Working memory of the step: sized in the first steps, reused afterwards. Nothing here outlives a step in meaning, except
// the contact springs and planes, which are the last step's answer that this step's integration feels.
#pragma once

#include "base/inside.hpp"
#include "collision/search/interruptible_search.hpp"
#include "engine/step/cull_stage.hpp"
#include "engine/step/report.hpp"
#include "engine/step/state.hpp"
#include "fem/rod/coaxial.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/stable_step.hpp"
#include "spheretree/traverse/descent.hpp"
#include "spheretree/traverse/sweep_and_prune.hpp"

#include <limits>
#include <optional>
#include <tuple>

namespace trocar::engine {

/// Where a rod's plane presses on a wall.
struct WallPress {
    Index triangle = kNoIndex; // of the lumen's surface; kNoIndex: nowhere
    std::array<double, 3> bary{1.0, 0.0, 0.0};
};

/// Coarse nodes that the spheres of a body hang on.
struct SphereNodes {
    std::vector<Index> begin;   // [sphere_count + 1]
    std::vector<Index> node;    // [entries]
    std::vector<double> weight; // [entries] sum of a sphere's: 1, less where its surface stands still
};

/// A pair of spheres that pushes or holds.
struct SphereHold {
    BodyId body_a = 0, body_b = 0;
    Index sphere_a = 0, sphere_b = 0;
    bool tested = false;         // false: the budget left it open
    Vec3 normal = Vec3::UnitX(); // unit, from b to a; of an open pair, as it was when it was first assumed
    double gap = 0.0;            // m, of the spheres
    Vec3 anchor = Vec3::Zero();  // m, of an open pair: where the first stood from the second then
    double hold = 0.0;           // m, of an open pair: how far aside it is drawn from there
    Vec3 aside = Vec3::Zero();   // unit, from b to a, that way
};

/// Leaves of two closed bodies beneath which surfaces are looked at.
struct LeafPair {
    std::size_t a = 0, b = 0; // a < b
    Index leaf_a = 0, leaf_b = 0;
    double gap = std::numeric_limits<double>::infinity(); // m, of the deepest touch that came from it

    [[nodiscard]] auto key() const noexcept { return std::tuple(a, b, leaf_a, leaf_b); }
};

/// A vertex of one body that is in another one, or through it, and where it went in.
struct SolidEntry {
    std::size_t own = 0, other = 0;
    Index vertex = 0;    // of own
    Index by = kNoIndex; // triangle of other: the side that it came by
    [[nodiscard]] auto key() const noexcept { return std::tuple(own, other, vertex); }
};

/// A touch of a vertex to which another side is nearer than the one it came by: its spring starts pressed by less than its depth.
struct PressedTouch {
    std::size_t touch = 0; // in SolidScratch::touches
    double pushed = 0.0;   // m
};

/// The springs of a vertex against another body, and by how much they were pressed at the end of the step.
struct SprungPlace {
    std::size_t own = 0, other = 0;
    Index vertex = 0;                               // of own
    Index spring_a = kNoIndex, spring_b = kNoIndex; // of own's owner, and of other's
    double pressed = 0.0;                           // m, that they started with
    double held = 0.0;                              // m, by how much they are pressed in the end; see note_held
    double scale = 1.0;                             // [-], of the scene's stiffness; see soften_springs
    Vec3 drawn = Vec3::Zero();                      // m, from other to own: by how much friction's are drawn along the surface

    [[nodiscard]] auto key() const noexcept { return std::tuple(own, other, vertex); }
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

/// The two springs of one contact: what the first body receives, the second should with the opposite sign.
struct SpringPair {
    std::size_t body_a = 0, body_b = 0;
    Index spring_a = kNoIndex, spring_b = kNoIndex; // into the owners' springs; kNoIndex: nothing gives way there
    Vec3 normal = Vec3::UnitX();
};

/// Contact between solid bodies.
struct SolidScratch {
    spheretree::SweepAndPrune sweep;
    Vec3 shared = Vec3::Zero();                // m, motion of this step that all solids may share; see find_common_motion
    std::vector<Vec3> drift;                   // [body_count] m/s, mean velocity at the step's end; 0 where something holds any body
    std::vector<Box3> boxes;                   // [body_count] of this step; empty: no solid that anything can touch
    std::vector<std::pair<Index, Index>> near; // bodies whose boxes overlap
    std::vector<LeafPair> leaf_pairs;
    std::vector<LeafPair> remembered;                 // those of the last step that touched, by key
    std::vector<std::pair<Index, Index>> open_bodies; // with open sphere pairs, whose depth the surfaces decide
    std::vector<ProbedSphere> heap;
    std::vector<std::pair<Index, Index>> meeting;    // bodies, lower first, whose surfaces are looked at
    std::vector<SolidEntry> entries, entries_before; // of this step and of the last one, by key
    std::vector<PressedTouch> pressed;
    std::vector<Index> self_vertices;            // of the body in hand that meet its own surface
    std::vector<Contact> touches;                // of this step: places of surfaces, with depth
    std::vector<SphereHold> holds, holds_before; // of this step and of the last one, by key
    std::vector<Piercing> piercings[2];
    std::vector<SpringPair> springs;                // of the last response
    std::vector<SprungPlace> sprung, sprung_before; // the vertices' among them, of this response and of the last one, by key
};

/// Of State::step: none, and none that comes before another.
inline constexpr std::uint64_t kNoStep = UINT64_MAX - 1;

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
    fem::LinkFrames frames;
    bool may_wait = false;      // nothing can meet it: what a step does with its tissue needs none of its surface
    bool surface_waits = false; // its frames are those of the step, its vertices are not placed yet
    fem::RkWorkspace rk;
    fem::StableStepWorkspace stable;
    fem::ContactSprings springs;       // made by the last step's response
    fem::ContactSprings other_springs; // of those, what is not contact between solids: of a body whose solids' springs wait
    std::vector<double> spring_scale;  // [springs] scratch of the response
    bool springs_met = false;          // and one of them would be pressed: it is integrated again with them
    bool springs_wait = false;         // it was integrated without its solids' springs: nothing touched it in the step
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
    spheretree::LumenState lumen;                    // hollow bodies
    std::uint64_t lumen_step = kNoStep;              // State::step at its last update; kNoStep: it saw another wall than the step left
    collision::DopTree tree;                         // hollow bodies, swept over the step
    WallAge wall_age;                                // of the tree
    std::vector<Vec3> flow_points;                   // [point_count] m, hollow bodies whose blood moves along with a carrier
    fem::LinkFrames flow_frames;
    InsideTest inside; // hollow bodies: the independent check; closed solids: depths of contacts
};

/// Somebody holds a point of a surface and pulls it towards a place.
struct Pull {
    std::size_t body = 0;       // of the model
    Index vertex = 0;           // of its surface
    Vec3 target = Vec3::Zero(); // m
};

struct InstrumentScratch {
    fem::RodState rod_t0;
    std::vector<Vec3> skin_t0;
    std::vector<Vec3> axis; // [node_count]
    fem::RodWorkspace rod;
    fem::RodReport rod_report;
    fem::CoaxialWorkspace coaxial; // with a wire inside
    DriveCommand command;
    std::optional<DriveCommand> hand; // what somebody's hand wants, in place of the script
    bool hand_stopped = false;        // in the last step: the motion that the hand asked for met the wall
    bool kept_inside = false;         // the last look found the rod within its wall, and every step since was looked at
    Route route;                      // where it is now
    fem::LinkFrames route_frames;
    std::vector<fem::RodFlow> flow; // [node_count] of the blood around it in this step
    spheretree::ChainState chain;
    std::vector<spheretree::Sphere> links_t0, links_t1;
    std::vector<fem::RodPlane> planes; // of the last solve
    std::vector<WallPress> presses;    // [planes]
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
    std::optional<Pull> pull;      // felt in every step until it is let go
    StepReport report;
};

[[nodiscard]] StepContext make_step_context(const SceneModel& model, const State& state);

} // namespace trocar::engine
