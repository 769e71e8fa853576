#include "engine/step/solid/solid_stage.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/self_touch.hpp"
#include "engine/step/solid/soften_springs.hpp"
#include "engine/step/solid/solid_hold.hpp"
#include "engine/step/solid/solid_passage.hpp"
#include "engine/step/solid/solid_touch.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/solid/spring_memory.hpp"
#include "engine/step/tissue/surface_spring.hpp"
#include "engine/step/solid/surface_travel.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// [-]; the heavier of two bodies takes at least so much of the way apart: less would make its springs that much stiffer, and their
/// stable step shorter.
constexpr double kLeastShare = 0.1;

/// [-]; friction's springs are damped by so much of what would be critical for the nodes beneath one place, without which what rests would
/// go on shivering on them. Several places hang on a node: together they come near to critical, and need no shorter stable step.
constexpr double kFrictionDamping = 0.1;

/// Pairs of bodies that the list of those who meet holds without growing.
constexpr std::size_t kReservedPairs = 4096;

/// A place of a contact's first or second body.
struct Place {
    std::size_t body;
    std::span<const Index> vertices;
    std::span<const double> weights;

    [[nodiscard]] Vec3 motion(const SceneModel& model, const State& state, const SolidScratch& solids) const {
        Vec3 moved = Vec3::Zero();
        if (!model.bodies[body].moves()) return moved;
        for (std::size_t k = 0; k < vertices.size(); ++k)
            moved += weights[k] * (state.bodies[body].surface[vertices[k]] - solids.bodies[body].surface_t0[vertices[k]]);
        return moved;
    }
};

struct Push {
    Vec3 direction; // unit, of the first body
    double gap, stiffness, damping;
    double limit = std::numeric_limits<double>::infinity(); // N
    double friction = 0.0;                                  // Coulomb's, of one that holds beneath the load of `under`
    const SpringPair* under = nullptr;                      // null: it does not
};

/// Does it hang on nodes that a force moves? What stands still, or goes its scripted way, takes any.
bool gives_way(const SceneModel& model, const Place& place) {
    const std::optional<fem::RigidLinks>& links = model.bodies[place.body].links;
    return links && std::any_of(place.vertices.begin(), place.vertices.end(), [&](Index v) { return links->vertex_frame[v] != kNoIndex; });
}

/// Of the gap between two places, so much is the first one's to close.
double share_of(const SceneModel& model, const Place& place, const Place& other) {
    if (!gives_way(model, place) || !gives_way(model, other)) return 1.0;
    const double own = model.bodies[owner_of(model, place.body)].tissue->mass;
    const double others = model.bodies[owner_of(model, other.body)].tissue->mass;
    return std::clamp(others / (own + others), kLeastShare, 1.0 - kLeastShare);
}

/// What one body gets of a push.
struct Side {
    const Place& place;
    Vec3 direction;        // unit, its own
    double share;          // of the gap
    double rate;           // m/s, of its share of the gap, by what does not hang on its nodes
    Index load = kNoIndex; // its spring of Push::under
};

SurfacePush make_push(const Place& place, const Push& push, double gap_share, double rate, Index load) {
    return {place.body,
            place.vertices,
            place.weights,
            push.direction,
            gap_share * push.gap,
            push.stiffness / gap_share,
            push.damping / gap_share,
            push.limit,
            rate,
            load,
            push.friction};
}

/// Index of the spring among its owner's.
Index push_side(const SceneModel& model, const Side& side, const Push& push, State& state) {
    const Place& place = side.place;
    if (!model.bodies[place.body].links) return kNoIndex;
    SurfacePush own = make_push(place, push, side.share, side.rate, side.load);
    own.direction = side.direction;
    if (!add_surface_spring(model, own, state)) return kNoIndex;
    return static_cast<Index>(state.bodies[owner_of(model, place.body)].springs.springs.size() - 1);
}

/// m/s; how the mass centre of two bodies moves, where nothing holds any.
Vec3 find_common_drift(const SceneModel& model, std::size_t a, std::size_t b, const SolidScratch& solids) {
    const std::optional<fem::TissueModel>&own = model.bodies[a].tissue, &other = model.bodies[b].tissue;
    if (!own || !other) return Vec3::Zero();
    return (own->mass * solids.drift[a] + other->mass * solids.drift[b]) / (own->mass + other->mass);
}

/// Both places hang on the nodes of one body: one spring between them.
void push_within(const SceneModel& model, const Place& a, const Place& b, const Push& push, State& state) {
    const SurfacePush on_a = make_push(a, push, 1.0, 0.0, push.under != nullptr ? push.under->spring_a : kNoIndex);
    const bool made = add_balanced_spring(model, on_a, {b.body, b.vertices, b.weights}, state);
    const std::size_t last = state.bodies[owner_of(model, a.body)].springs.springs.size();
    state.solids.springs.push_back({a.body, b.body, made ? static_cast<Index>(last - 1) : kNoIndex, kNoIndex, push.direction});
}

/// Each body is integrated against the other as it stands at the step's start. If each took the whole gap for its own, both would close
/// it, and go as far into one another as it was wide: energy from nowhere. So each has its share of it, the lighter one the larger, and
/// a spring as much stiffer: where they overlap both feel the same force as before, which fades as it does between two free masses.
/// What they go too far by, d_a and d_b, has cost them k (d_a^2 / share_a + d_b^2 / share_b) / 2, never less than the k (d_a + d_b)^2 / 2
/// that the next step's springs start with: energy is lost, not found. The price: something that stands in the way and does not move is
/// felt before it is reached, by half of what the two came nearer in the step.
/// Where nothing holds any body, two are seen from their common mass centre: what flies along together stands still there. (Where something
/// does, planes that move would do work on what is pressed against it.)
/// What a script moves is known ahead: the springs go along with it during the step. If it stood still and jumped at the step's end, each
/// spring would begin with k (v h)^2 / 2 from nowhere, for a speed v and a step h: stiff ones would throw off what is pressed slowly.
void push_both(const SceneModel& model, const Place& a, const Place& b, const Push& push, State& state, SolidScratch& solids) {
    const std::size_t owner_a = owner_of(model, a.body), owner_b = owner_of(model, b.body);
    if (owner_a == owner_b && model.bodies[a.body].links && model.bodies[b.body].links)
        return push_within(model, a, b, push, state);
    const double rate = push.direction.dot(solids.bodies[a.body].coming - solids.bodies[b.body].coming) / model.step_s;
    const double drift = push.direction.dot(find_common_drift(model, owner_a, owner_b, solids));
    const double share_a = share_of(model, a, b), share_b = share_of(model, b, a);
    const SpringPair load = push.under != nullptr ? *push.under : SpringPair{};
    const Index on_a = push_side(model, {a, push.direction, share_a, share_a * rate - drift, load.spring_a}, push, state);
    const Index on_b = push_side(model, {b, -push.direction, share_b, share_b * rate + drift, load.spring_b}, push, state);
    state.solids.springs.push_back({a.body, b.body, on_a, on_b, push.direction});
}

/// m; friction's spring after a slip: drawn along with it, and dragged where it would pull harder than Coulomb's cone.
/// source   Cundall & Strack 1979, tangential force of their contacts
Vec3 draw_on(const Vec3& before, const Vec3& slip, const Vec3& normal, double longest) {
    Vec3 drawn = before + slip;
    drawn -= drawn.dot(normal) * normal;
    const double length = drawn.norm();
    return length > longest ? Vec3((longest / length) * drawn) : drawn;
}

/// 1/kg; how fast the nodes that a spring hangs on let its place give way. 0: it does not.
double find_lightness(const SceneModel& model, std::size_t body, Index index, const State& state) {
    if (index == kNoIndex) return 0.0;
    const std::size_t owner = owner_of(model, body);
    const fem::ContactSprings& springs = state.bodies[owner].springs;
    const fem::ContactSpring& spring = springs.springs[index];
    double lightness = 0.0;
    for (Index k = spring.first_entry; k < spring.first_entry + spring.entry_count; ++k)
        lightness += springs.entries[k].g.squaredNorm() / model.bodies[owner].tissue->node_mass[springs.entries[k].node];
    return lightness;
}

/// Two springs along the surface: the way that it was drawn and across, each at any moment within mu times what the place is pressed with
/// at that moment. How far they are drawn is bounded by the larger of the loads at the ends of the step: one that bounces a little from
/// step to step does not lose its hold at each end where it is light.
void hold_against_slip(const SceneModel& model, const Contact& touch, const Place& a, const Place& b, State& state,
                       SolidScratch& solids, WarmStartSpring& own) {
    const ContactSpec& contact = model.contact;
    const WarmStartSpring* before = find_warm_spring(solids, touch);
    const Vec3 slip = a.motion(model, state, solids) - b.motion(model, state, solids); // m, in the step
    const double longest = contact.solid_friction * std::max(own.pressed, before != nullptr ? before->pressed : 0.0);
    own.drawn = draw_on(before != nullptr ? before->drawn : Vec3(Vec3::Zero()), slip, touch.normal, longest);
    const double length = own.drawn.norm();
    const Vec3 along = length > 0.0 ? Vec3(-own.drawn / length) : touch.normal.unitOrthogonal();
    const SpringPair load = state.solids.springs.back();
    const double lightness =
        find_lightness(model, load.body_a, load.spring_a, state) + find_lightness(model, load.body_b, load.spring_b, state);
    const double damping = lightness > 0.0 ? 2.0 * kFrictionDamping * std::sqrt(contact.solid_stiffness / lightness) : 0.0;
    for (const auto& [direction, gap] : {std::pair(along, -length), std::pair(Vec3(touch.normal.cross(along)), 0.0)})
        push_both(model, a, b,
                  {.direction = direction,
                   .gap = gap,
                   .stiffness = contact.solid_stiffness,
                   .damping = damping,
                   .friction = contact.solid_friction,
                   .under = &load},
                  state, solids);
}

/// gap: m, that its springs start with
void push_touch(const SceneModel& model, const Contact& touch, double gap, State& state, SolidScratch& solids, StepReport& report) {
    const ContactSpec& contact = model.contact;
    const std::size_t corners = touch.feature_a[1] == kNoIndex ? 1 : 2;
    const Place a{touch.body_a, std::span(touch.feature_a).first(corners), std::span(touch.bary_a).first(corners)};
    const Place b{touch.body_b, touch.feature_b, touch.bary_b};
    push_both(model, a, b, {touch.normal, gap, contact.solid_stiffness, contact.solid_damping}, state, solids);
    WarmStartSpring of_edge; // forgotten: it holds from the slip of the last step on
    of_edge.pressed = std::max(0.0, -gap);
    WarmStartSpring* own = store_warm_spring(touch, gap, state.solids);
    if (!(contact.solid_friction > 0.0)) return;
    report.effects.note(Effect::Friction);
    hold_against_slip(model, touch, a, b, state, solids, own != nullptr ? *own : of_edge);
}

/// N; what a spring pushes with at the step's end, as its nodes stand.
double force_of(const SceneModel& model, std::size_t body, Index index, const State& state, std::span<const TissueScratch> tissue) {
    const std::size_t owner = owner_of(model, body);
    if (tissue[owner].springs_deferred) return 0.0; // they were not felt
    return fem::find_spring_push(state.bodies[owner].springs, index, model.step_s, state.bodies[owner].tissue.position);
}

/// Mean velocities of bodies, at the step's end, where nothing holds any of them.
void find_drifts(const SceneModel& model, const State& state, SolidScratch& solids) {
    solids.drift.assign(model.bodies.size(), Vec3::Zero());
    if (!are_all_free(model)) return;
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (const auto& tissue = model.bodies[i].tissue; tissue)
            solids.drift[i] = fem::find_momentum(*tissue, state.bodies[i].tissue).linear / tissue->mass;
}

void note_depth(const Contact& touch, const SolidScratch& solids, StepReport& report) {
    report.deepest_touch_m = std::max(report.deepest_touch_m, -touch.gap);
    if (touch.body_a == touch.body_b) return;
    const double thinner = std::min(solids.bodies[touch.body_a].thickness, solids.bodies[touch.body_b].thickness);
    if (thinner > 0.0) report.deepest_share = std::max(report.deepest_share, -touch.gap / thinner);
}

} // namespace

void prepare_solids(const SceneModel& model, const State& state, SolidScratch& solids) {
    solids.bodies.resize(model.bodies.size());
    std::size_t vertices = 0; // of closed bodies that something can touch
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!can_touch_any(model, i)) continue;
        solids.bodies[i].sphere_nodes = make_sphere_nodes(model, i);
        solids.bodies[i].thickness = find_thickness(model.bodies[i].surface.vertices);
        if (!meet_by_surface(model, i, i)) continue;
        solids.bodies[i].inside = InsideTest(model.bodies[i].surface);
        vertices += model.bodies[i].surface.vertices.size();
        solids.bodies[i].inside.refit(state.bodies[i].surface);
        const spheretree::SphereTree& tree = model.bodies[i].covering.tree;
        solids.bodies[i].leaf_of_triangle.assign(model.bodies[i].surface.triangles.size(), kNoIndex);
        for (Index s = 0; s < tree.sphere_count(); ++s)
            if (tree.is_leaf(s))
                for (const Index t : tree.items_of(s)) solids.bodies[i].leaf_of_triangle[t] = s;
    }
    solids.entries_before.reserve(vertices);
    solids.vertex_springs_before.reserve(vertices);
    solids.pressed.reserve(vertices);
    solids.meeting.reserve(std::min<std::size_t>(model.bodies.size() * (model.bodies.size() + 1) / 2, kReservedPairs));
}

void add_solid_pairs(const SceneModel& model, SolidScratch& solids, spheretree::Descent& descent, StepReport& report) {
    solids.boxes.assign(model.bodies.size(), Box3{});
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!has_spheres(solids, i)) continue;
        const spheretree::Sphere& root = sphere_of(i, 0, solids);
        if (root.radius < 0.0) continue;
        solids.boxes[i].add(root.centre);
        solids.boxes[i].inflate(root.radius + model.contact.margin);
    }
    solids.sweep.find_pairs(solids.boxes, solids.near);
    for (const auto& [i, j] : solids.near)
        if (are_solid_pair(model, i, j))
            descent.add_solid_pair(view_solid(model, i, solids), view_solid(model, j, solids));
        else
            report.unproven_solids += are_nested(model, i, j);
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (touches_itself(model, i)) {
            report.effects.note(Effect::SelfContact);
            descent.add_self_pair(view_self(model, i, solids));
        }
}

void push_solids(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report) {
    state.solids.springs.clear();
    find_drifts(model, state, solids);
    find_touches(model, state, solids, report);
    auto pressed = solids.pressed.begin();
    for (std::size_t k = 0; k < solids.touches.size(); ++k) {
        const Contact& touch = solids.touches[k];
        const bool is_pressed = pressed != solids.pressed.end() && pressed->touch == k;
        const double gap = is_pressed ? -(pressed++)->pushed : find_start_gap(model, solids, touch);
        push_touch(model, touch, gap, state, solids, report);
        report.solid_touches += touch.gap <= 0.0;
        note_depth(touch, solids, report);
    }
    sort_memory(state.solids);
    push_spheres(model, state, solids);
    soften_springs(model, state, solids, report);
    report.held_pairs = state.solids.holds.size();
}

double find_residual(const SceneModel& model, const State& state, std::span<const TissueScratch> tissue) {
    Vec3 sum = Vec3::Zero();
    for (const SpringPair& pair : state.solids.springs) {
        if (pair.spring_a == kNoIndex || pair.spring_b == kNoIndex) continue; // what stands still takes any force
        sum += (force_of(model, pair.body_a, pair.spring_a, state, tissue) - force_of(model, pair.body_b, pair.spring_b, state, tissue)) *
               pair.normal;
    }
    return sum.norm();
}

} // namespace trocar::engine
