// What a scene becomes once it is prepared: built once, then only read by the step.
#pragma once

#include "base/mesh.hpp"
#include "collision/topology.hpp"
#include "engine/prepare/blood.hpp"
#include "engine/prepare/drive.hpp"
#include "engine/scene/effect.hpp"
#include "engine/scene/settings.hpp"
#include "engine/time/limits.hpp"
#include "fem/tissue/material.hpp"
#include "fem/embedding/links.hpp"
#include "fem/rod/rod_skin.hpp"
#include "fem/tissue/implicit_system.hpp"
#include "fem/tissue/tissue.hpp"
#include "spheretree/update/chain_tree.hpp"
#include "spheretree/update/covering_tree.hpp"
#include "spheretree/update/deforming_tree.hpp"
#include "spheretree/lumen/lumen_tree.hpp"

#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

enum class Motion : std::uint8_t { Deformable, Kinematic, Static };

/// Displacement of a kinematic body over time, linear between rows.
struct MotionRow {
    double time = 0.0;                // s, ascending
    Vec3 displacement = Vec3::Zero(); // m, from the rest pose
};

/// Held nodes that move as told.
struct HeldNodes {
    std::vector<Index> pinned; // places in TissueModel::pinned, ascending
    std::vector<MotionRow> moves;
    std::vector<LoadRow> turns; // rad
    Vec3 point = Vec3::Zero(), axis = Vec3::UnitZ();
};

/// A load on a body's nodes.
struct BodyLoad {
    LoadKind kind = LoadKind::Force;
    Vec3 vector = Vec3::Zero();
    double number = 0.0;
    std::vector<LoadRow> over;
    std::vector<Index> nodes;    // ascending; empty for loads on faces
    std::vector<double> share;   // [nodes] of their mass in all
    std::vector<Triangle> faces; // coarse nodes, outward
    std::vector<double> area;    // [faces] m^2 at rest
};

/// Of a vessel's wall: ties of its outside's nodes to the tetrahedra of an organ.
struct WallJoint {
    std::size_t host = 0; // a body after it
    std::vector<fem::Tie> ties;
};

struct BodyModel {
    std::string name;
    Motion motion = Motion::Static;
    TriMesh surface;                        // rest pose, outward where closed
    bool hollow = false;                    // a lumen: instruments move inside
    bool is_free_space = false;             // hollow: around other bodies, whose surfaces its wall repeats; nothing draws it
    bool closed = false;                    // and consistently oriented: it has an inside
    std::optional<fem::TissueModel> tissue; // deformable bodies
    std::optional<fem::ImplicitSystem> implicit; // tissue that is advanced implicitly
    std::optional<std::size_t> host_body;   // deformable host body that this surface is embedded in; a vessel with a wall of its own: itself
    std::optional<fem::RigidLinks> links;   // surface embedded in its own mesh, or in the host's
    std::optional<WallJoint> joint;         // a vessel's wall that is joined to the organ around it
    std::vector<double> tied;               // [node_count] 1/s^2, by record, of tissue with ties: what they add to a stable step's bound; else empty
    bool self_contact = true;               // where the scene has that effect
    std::vector<MotionRow> path;            // kinematic bodies
    std::vector<HeldNodes> held;            // deformable bodies: those of their held nodes that move
    std::vector<BodyLoad> loads;            // deformable bodies, with the effect loads
    std::vector<double> node_give;          // [node_count] m/N, of tissue: by how much a force over a step moves a node; 0 where it is held
    Vec3 velocity = Vec3::Zero();           // m/s, of tissue at the start
    Vec3 spin = Vec3::Zero();               // rad/s, of tissue at the start
    collision::SurfaceTopology topology;
    std::vector<Index> sharp_edges;                   // closed solid bodies: of the topology (find_sharp_edges)
    std::vector<Vec3> pulse_reach;                    // [vertex_count] m, to the systolic position; hollow bodies under the effect pulse
    spheretree::CoveringTree covering;                // solid bodies; of a wrapped tree, or one from a file, the tree alone
    std::optional<spheretree::DeformingTree> wrapped; // solid bodies on coarse nodes, unless SphereTrees::Covering
    std::optional<spheretree::LumenTree> lumen;       // hollow bodies
    std::optional<BloodFlow> blood;                   // hollow bodies with an instrument inside, under the effect blood_drag

    /// Its vertices without a frame never leave their rest position.
    [[nodiscard]] bool moves_by_links_alone() const noexcept { return links && pulse_reach.empty(); }
    [[nodiscard]] bool moves() const noexcept { return motion != Motion::Static || host_body || !pulse_reach.empty(); }
};

/// What holds the last segment of a rod, and how it moves.
struct TipHold {
    bool slides = false, spins = false;
    std::vector<LoadRow> rotation; // rad about its own axis
    std::vector<MotionRow> moves;
    std::vector<LoadRow> turns; // rad
    Vec3 point = Vec3::Zero(), axis = Vec3::UnitZ();
};

struct InstrumentModel {
    std::string name;
    fem::RodModel rod;
    fem::RodSkin skin;
    fem::RodPort port;
    std::size_t lumen = 0;             // body whose lumen it moves in
    unsigned mass_spring_substeps = 0; // of a step, of a chain of masses and springs; 0: the implicit rod
    std::optional<std::size_t> inside; // instrument in whose bore it runs, as a wire
    double play = 0.0;                 // m, there; 0: on its axis
    std::optional<std::size_t> wire;   // instrument that runs in its own bore, on one axis with it
    std::optional<std::size_t> loose_wire; // the same with play
    bool self_contact = false;         // meets itself, where the scene has that effect: an implicit rod alone
    bool detachable = false;           // its drive may push it wholly out of its port
    std::vector<std::size_t> waits_for; // detachable instruments before it in the same port: it stays in there until they are out
    double friction = 0.0;             // Coulomb mu
    double inserted = 0.02;            // m at the start
    Vec3 tip_force = Vec3::Zero();     // N, with the effect loads
    double tip_torque = 0.0;           // N m, the same
    std::vector<LoadRow> tip_over;     // factor of both over time; empty: 1
    std::optional<TipHold> tip_hold;   // none: the tip is free
    DriveLimits limits;
    std::vector<DriveRow> path;                 // followed; with a route too that only measures
    std::optional<Route> route;                 // at rest
    std::optional<fem::RigidLinks> route_links; // the route moves with the host organ of the lumen
    FollowSettings follow;
    Index flow_entry = 0;                // of the lumen's blood flow: the point at the port
    spheretree::ChainTree chain;         // links at nodes and midway between them, tip first
    collision::SurfaceTopology topology; // of the skin
};

/// m; how far its drive pushes it out at most: drive commands are multiples of 2^-40 m.
[[nodiscard]] inline double longest_insertion(const InstrumentModel& instrument) noexcept {
    const fem::RodModel& rod = instrument.rod;
    return instrument.detachable ? std::floor(rod.design.length * 0x1p40) * 0x1p-40 : rod.design.length - 2.0 * rod.segment;
}

/// On one axis with the instrument in whose bore it runs: whatever is done to that one is done to it.
[[nodiscard]] inline bool shares_axis(const InstrumentModel& instrument) noexcept { return instrument.inside && !(instrument.play > 0.0); }

/// With the effect instrument_contact: an implicit rod with an axis of its own, whose tip is free.
[[nodiscard]] inline bool meets_instruments(const InstrumentModel& instrument) noexcept {
    return instrument.mass_spring_substeps == 0 && !shares_axis(instrument) && !instrument.wire && !instrument.tip_hold;
}

/// One of two rods of which one has play in the other's bore: they are solved together whatever effects there are.
[[nodiscard]] inline bool has_play(const InstrumentModel& instrument) noexcept { return instrument.play > 0.0 || instrument.loose_wire; }

struct SceneModel {
    std::string name;
    std::string file;     // as given, relative to the project where it lies in it
    double step_s = 0.01; // s
    std::uint64_t step_count = 0;
    unsigned fixed_substeps = 0;   // fixed by the scene; 0: as many as stability needs
    unsigned max_substeps = 10000; // beyond this a step would take minutes: stopped with the number
    fem::Integrator integrator = fem::Integrator::Rk4; // of bodies that are advanced explicitly
    BudgetLimits budget;
    bool budget_covers_step = false; // scope: the whole step, not collision alone
    std::vector<Droppable> drop;     // scope step: what may be left out of a step that would not fit, first to go first
    std::vector<BodyModel> bodies;
    /// Solids of which one starts wholly inside the other, lower id first, sorted. They do not touch one another: depth without elastic
    /// energy would throw them apart. Steps in which they come near count them as unproven.
    std::vector<std::pair<std::size_t, std::size_t>> nested;
    std::vector<InstrumentModel> instruments;
    EffectSet effects;
    ContactSpec contact;
    std::optional<PackingSpec> packing; // reported
};

/// Is it one of those that a joint solve may take: see fem::solve_together.
[[nodiscard]] inline bool may_be_joined(const SceneModel& model, std::size_t instrument) noexcept {
    const InstrumentModel& own = model.instruments[instrument];
    return has_play(own) || (model.effects.instrument_contact && meets_instruments(own));
}

} // namespace trocar::engine
