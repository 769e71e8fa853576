// All that one step leaves for the next. A step reads nothing else of the past: a copy of a State is a fork, and goes on to the same bits.
// What hash, save and load see of it is listed once, in visit_state.hpp.
#pragma once

#include "base/contact.hpp"
#include "engine/prepare/model.hpp"
#include "engine/state/views.hpp"
#include "fem/embedding/links.hpp"
#include "fem/rod/rod.hpp"
#include "fem/tissue/stable_step.hpp"
#include "spheretree/lumen/lumen_state.hpp"
#include "spheretree/update/chain_tree.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>

namespace trocar::engine {

enum class FollowMode : std::uint8_t {
    Advance, // push, the tip turned to the route ahead
    Retract, // the tip went astray or stuck: back until it stands before that fork again
    Turn,    // before the fork: turn the tip to this attempt's angle
    Probe,   // push past the fork, the handle held or the aim kept beside the first one's
    Arrived, // still, until the tip slips away from the end of the route
};

/// What the rule that follows a route leaves for its next command. Plain data: part of the state, so that a run can be repeated bit for bit.
struct FollowState {
    FollowMode mode = FollowMode::Advance;
    double progress = 0.0;         // m along the route of the point nearest to the tip
    double best_progress = 0.0;    // m, furthest on the route since the last retraction
    double best_insertion = 0.0;   // m, when best_progress last grew, or patience was last renewed
    double astray_insertion = 0.0; // m, where the tip was last on the route
    double fork = 0.0;             // m along the route: where the attempt failed
    double retract_from = 0.0;     // m of insertion
    double turned_for = 0.0;       // s in Turn; in Advance s beside the end
    double missing = 0.0;          // m, tip to the end of the route
    unsigned attempts = 0;         // at this fork
};

/// A State::step that is none, and comes before none.
inline constexpr std::uint64_t kNoStep = UINT64_MAX - 1;

/// Where a rod's plane presses on a wall.
struct WallPress {
    Index triangle = kNoIndex; // of the lumen's surface; kNoIndex: nowhere
    std::array<double, 3> bary{1.0, 0.0, 0.0};
    double give = 0.0; // m/N, of the wall within a step; 0: nothing moves it
};

/// Leaves of two closed bodies beneath which surfaces are tested.
struct LeafPair {
    std::size_t a = 0, b = 0; // a < b
    Index leaf_a = 0, leaf_b = 0;
    double gap = std::numeric_limits<double>::infinity(); // m, of the deepest touch that came from it

    /// Orders by a, b, leaf_a, leaf_b; in two numbers, for thousands of them are sorted in a step.
    [[nodiscard]] auto key() const noexcept {
        const auto join = [](std::uint64_t high, std::uint64_t low) { return high << 32 | low; };
        return std::pair(join(a, b), join(leaf_a, leaf_b));
    }
};

/// A vertex of one body that is in another one, or through it, and where it went in.
struct SolidEntry {
    std::size_t own = 0, other = 0;
    Index vertex = 0;    // of own
    Index by = kNoIndex; // triangle of other: the side that it came by
    double depth = 0.0;  // m, back to that side at the end of the last step
    [[nodiscard]] auto key() const noexcept { return std::tuple(own, other, vertex); }
};

/// A place where two solids may push one another in the next step, and what they pushed with at the end of the last one.
struct SolidContact {
    Contact touch;               // as the last step left it; its force is that step's
    double recovery = 0.0;       // m/s, at which it is pushed out where it lies in the other body
    Vec3 warm = Vec3::Zero();    // N, on the first body, at the step's end: warm start
    /// m; above 0 it is no place: the budget left what is between the two bodies, and they are held as wholes. Approach ends within so much.
    double room = 0.0;

    /// Of the place on the first body and of the second body; where edges cross, of that one's edge too.
    [[nodiscard]] auto key() const noexcept {
        const bool edges = touch.between_edges();
        return std::tuple(touch.a, touch.b, touch.feature_a[0], touch.feature_a[1], room > 0.0, edges ? touch.feature_b[0] : kNoIndex,
                          edges ? touch.feature_b[1] : kNoIndex);
    }
};

struct BodyState {
    fem::TissueState tissue;             // deformable bodies
    std::vector<Vec3> surface;           // [vertex_count] m, at the end of the last step
    bool surface_deferred = false;          // the frames are those of the step's end, the surface is evaluated when it is asked for
    fem::LinkFrames frames;              // of the links that carry the surface
    fem::LinkFrames flow_frames;         // of the centreline on which the blood flows, where tissue carries it
    fem::StableStepWorkspace stable;     // warm start of the stable step: modes and rates (StableStepMemory)
    spheretree::LumenState lumen;        // hollow bodies: inscribed spheres as the last step left them
    std::uint64_t lumen_step = kNoStep;  // State::step at its last update; kNoStep: it saw another wall than the step left
    /// J, deformable bodies: its share of what contact impulses have taken of late. Pushing out gives no more back.
    double contact_work = 0.0;
};

struct InstrumentState {
    fem::RodState rod;
    std::vector<Vec3> skin; // [skin vertex_count] m, at the end of the last step
    FollowState follow;
    bool drive_stopped = false;        // in the last step: the motion that the drive command asked for met the wall
    bool kept_inside = false;         // the last test found the rod within its wall, and every step since was tested
    Route route;                      // where it is now; the model's radii and lengths
    fem::LinkFrames route_frames;
    spheretree::ChainState chain;          // its hints: the lumen's spheres that held the links in the last step
    std::vector<fem::RodPlane> planes;     // of the last solve: what the next one looks ahead with
    std::vector<WallPress> presses;        // [planes]
    std::vector<fem::RodPlane> self_planes; // that places of its own rod carry, of the last solve
    std::uint64_t exact_candidates = 0;    // of the last exact stage: the forecast of the next
};

/// Contact between solid bodies: warm start of the next step's.
struct SolidContactState {
    std::vector<LeafPair> touching;          // leaf pairs of the last step that touched, by key
    std::vector<SolidEntry> entries;         // vertices that are in another body, by key
    std::vector<SolidContact> contacts;      // places that push in the next step, by key
};

struct State {
    std::uint64_t step = 0;        // steps done
    double time = 0.0;             // s
    std::vector<BodyState> bodies; // as SceneModel::bodies
    std::vector<InstrumentState> instruments;
    SolidContactState solids;
    std::vector<fem::RodMeeting> meetings; // places of instruments that others carry, of the last solve
    std::vector<std::vector<double>> effects; // as SceneModel::effects.added: EffectDescriptor::memory
};

[[nodiscard]] State make_initial_state(const SceneModel& model);

} // namespace trocar::engine
