#include "engine/step/solid_stage.hpp"

#include "engine/step/self_touch.hpp"
#include "engine/step/solid_hold.hpp"
#include "engine/step/solid_passage.hpp"
#include "engine/step/solid_touch.hpp"
#include "engine/step/solid_trees.hpp"
#include "engine/step/spring_memory.hpp"
#include "engine/step/surface_spring.hpp"
#include "engine/step/tissue_stage.hpp"

#include <algorithm>
#include <cmath>

namespace seldinger::engine {

namespace {

/// m/s; below this slip the friction of places that are not remembered from step to step (edges) fades with it, so that a force which
/// is fixed for a step does not turn the slip round: mu g step stays below it up to mu = 0.4 at 5 ms.
constexpr double kSlip = 0.02;

/// [-]; the heavier of two bodies takes at least so much of the way apart: less would make its springs that much stiffer, and their
/// stable step shorter.
constexpr double kLeastShare = 0.1;

/// Steps; friction's springs are damped by so many times their stiffness: without, what rests would go on shivering on them. Twice as
/// much leaves a third of the shivering, and the damping's own stable step takes 1.7 times as long.
constexpr double kFrictionLag = 0.5;

/// Pairs of bodies that the list of those who meet holds without growing.
constexpr std::size_t kReservedPairs = 4096;

/// A place of a contact's first or second body.
struct Place {
    std::size_t body;
    std::span<const Index> vertices;
    std::span<const double> weights;

    [[nodiscard]] Vec3 motion(const SceneModel& model, const State& state, const StepContext& context) const {
        Vec3 moved = Vec3::Zero();
        if (!model.bodies[body].moves()) return moved;
        for (std::size_t k = 0; k < vertices.size(); ++k)
            moved += weights[k] * (state.bodies[body].surface[vertices[k]] - context.bodies[body].surface_t0[vertices[k]]);
        return moved;
    }

    /// m/s; how scripts move it on in the coming step.
    [[nodiscard]] Vec3 scripted_velocity(const SceneModel& model, const State& state) const {
        const double now = state.time + model.step_s; // the state's time is that of the step's start
        return find_scripted_way(model, body, vertices, weights, now, now + model.step_s) / model.step_s;
    }
};

struct Push {
    Vec3 direction; // unit, of the first body
    double gap, stiffness, damping, limit;
    bool holds = false; // pulls, too
    double rate = 0.0;  // m/s, of the gap, by what scripts move
};

/// Index of the spring among its owner's.
Index push_place(const SceneModel& model, const Place& place, const Vec3& direction, const Push& push, const State& state,
                 StepContext& context) {
    if (!model.bodies[place.body].links) return kNoIndex;
    if (!add_surface_spring(model,
                            {place.body, place.vertices, place.weights, direction, push.gap, push.stiffness, push.damping, push.limit,
                             push.rate, push.holds},
                            state, context))
        return kNoIndex;
    return static_cast<Index>(context.bodies[owner_of(model, place.body)].springs.springs.size() - 1);
}

/// Of the gap between two bodies that move, so much is the first one's to close; 1 where the other takes any force.
double share_of(const SceneModel& model, std::size_t body, std::size_t other) {
    if (!model.bodies[body].links || !model.bodies[other].links) return 1.0;
    const double own = model.bodies[owner_of(model, body)].tissue->mass, others = model.bodies[owner_of(model, other)].tissue->mass;
    return std::clamp(others / (own + others), kLeastShare, 1.0 - kLeastShare);
}

/// Index of the spring that one side gets.
Index push_side(const SceneModel& model, const Place& place, const Vec3& direction, const Push& push, double share, const State& state,
                StepContext& context) {
    Push own = push;
    own.gap = share * push.gap;
    own.rate = share * push.rate;
    own.stiffness = push.stiffness / share;
    own.damping = push.damping / share;
    return push_place(model, place, direction, own, state, context);
}

/// Each body is integrated against the other as it stands at the step's start. If each took the whole gap for its own, both would close
/// it, and go as far into one another as it was wide: energy from nowhere. So each has its share of it, the lighter one the larger, and
/// a spring as much stiffer: where they overlap both feel the same force as before, which fades as it does between two free masses.
/// What they go too far by, d_a and d_b, has cost them k (d_a^2 / share_a + d_b^2 / share_b) / 2, never less than the k (d_a + d_b)^2 / 2
/// that the next step's springs start with: energy is lost, not found. The price: something that stands in the way and does not move is
/// felt before it is reached, by half of what the two came nearer in the step.
/// What a script moves is known ahead: the springs go along with it during the step. If it stood still and jumped at the step's end, each
/// spring would begin with k (v h)^2 / 2 from nowhere, for a speed v and a step h: stiff ones would throw off what is pressed slowly.
void push_both(const SceneModel& model, const Place& a, const Place& b, Push push, const State& state, StepContext& context) {
    push.rate = push.direction.dot(a.scripted_velocity(model, state) - b.scripted_velocity(model, state));
    const Index on_a = push_side(model, a, push.direction, push, share_of(model, a.body, b.body), state, context);
    const Index on_b = push_side(model, b, -push.direction, push, share_of(model, b.body, a.body), state, context);
    context.solids.springs.push_back({a.body, b.body, on_a, on_b, push.direction});
}

/// Of a place that is in: what `entries` remembers of it; nullptr: an edge, or a place outside.
template <class Entries>
auto find_entry_of(Entries& entries, const Contact& touch) -> decltype(entries.data()) {
    if (touch.feature_a[1] != kNoIndex) return nullptr;
    return find_entry(entries, {touch.body_a, touch.body_b, touch.feature_a[0]});
}

/// m; friction's spring after a slip: drawn along with it, and dragged where it would pull harder than Coulomb's cone.
/// source   Cundall & Strack 1979, tangential force of their contacts
Vec3 draw_on(const Vec3& before, const Vec3& slip, const Vec3& normal, double longest) {
    Vec3 drawn = before + slip;
    drawn -= drawn.dot(normal) * normal;
    const double length = drawn.norm();
    return length > longest ? Vec3((longest / length) * drawn) : drawn;
}

/// gap: m, that its springs start with
void push_touch(const SceneModel& model, const Contact& touch, double gap, const State& state, StepContext& context) {
    const ContactSettings& contact = model.contact;
    const std::size_t corners = touch.feature_a[1] == kNoIndex ? 1 : 2;
    const Place a{touch.body_a, std::span(touch.feature_a).first(corners), std::span(touch.bary_a).first(corners)};
    const Place b{touch.body_b, touch.feature_b, touch.bary_b};
    constexpr double kNoLimit = std::numeric_limits<double>::infinity();
    push_both(model, a, b, {touch.normal, gap, contact.solid_stiffness, contact.solid_damping, kNoLimit}, state, context);
    remember_springs(touch, context.solids);
    const double most = contact.solid_friction * contact.solid_stiffness * std::max(0.0, -gap);
    if (!(most > 0.0)) return;
    context.report.effects.note(Effect::Friction);
    Vec3 slip = a.motion(model, state, context) - b.motion(model, state, context); // m, in the step
    slip -= slip.dot(touch.normal) * touch.normal;
    if (SolidEntry* own = find_entry_of(context.solids.entries, touch); own != nullptr) {
        const SolidEntry* before = find_entry_of(context.solids.entries_before, touch);
        own->drawn = draw_on(before != nullptr ? before->drawn : Vec3(Vec3::Zero()), slip, touch.normal, most / contact.solid_stiffness);
        const double length = own->drawn.norm();
        if (length > 0.0)
            push_both(
                model, a, b,
                {-own->drawn / length, -length, contact.solid_stiffness, kFrictionLag * model.step_s * contact.solid_stiffness, most, true},
                state, context);
        return;
    }
    const double way = slip.norm();
    if (!(way > 0.0)) return;
    const double force = most * std::min(1.0, way / (kSlip * model.step_s));
    push_both(model, a, b, {-slip / way, -force / contact.solid_stiffness, contact.solid_stiffness, 0.0, force}, state, context);
}

/// N; what a spring pushes with at the step's end, as its nodes stand.
double force_of(const SceneModel& model, std::size_t body, Index index, const State& state, const StepContext& context) {
    const fem::ContactSpring& spring = context.bodies[owner_of(model, body)].springs.springs[index];
    const double gap = find_spring_gap(model, body, index, model.step_s, state, context);
    return std::clamp(-gap * spring.stiffness, spring.holds ? -spring.limit : 0.0, spring.limit);
}

void note_depth(const Contact& touch, StepContext& context) {
    StepReport& report = context.report;
    report.deepest_touch_m = std::max(report.deepest_touch_m, -touch.gap);
    if (touch.body_a == touch.body_b) return;
    const double thinner = std::min(context.bodies[touch.body_a].thickness, context.bodies[touch.body_b].thickness);
    if (thinner > 0.0) report.deepest_share = std::max(report.deepest_share, -touch.gap / thinner);
}

} // namespace

bool are_nested(const SceneModel& model, std::size_t i, std::size_t j) noexcept {
    return std::binary_search(model.nested.begin(), model.nested.end(), std::pair(std::min(i, j), std::max(i, j)));
}

bool are_solid_pair(const SceneModel& model, std::size_t i, std::size_t j) noexcept {
    const BodyModel& a = model.bodies[i];
    const BodyModel& b = model.bodies[j];
    if (a.hollow || b.hollow || (!a.moves() && !b.moves()) || are_nested(model, i, j)) return false;
    return a.carrier != j && b.carrier != i;
}

bool can_touch_any(const SceneModel& model, std::size_t body) noexcept {
    for (std::size_t other = 0; other < model.bodies.size(); ++other)
        if (other != body && (are_solid_pair(model, body, other) || are_nested(model, body, other))) return true;
    return touches_itself(model, body);
}

void prepare_solids(const SceneModel& model, const State& state, StepContext& context) {
    std::size_t vertices = 0; // of closed bodies that something can touch
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!can_touch_any(model, i)) continue;
        context.bodies[i].sphere_nodes = make_sphere_nodes(model, i);
        context.bodies[i].thickness = find_thickness(model.bodies[i].surface.vertices);
        if (model.bodies[i].wrapped) { // the frames as they stand: the first step starts from there
            BodyScratch& scratch = context.bodies[i];
            scratch.surface_ahead.resize(model.bodies[i].surface.vertices.size());
            (void)fem::steer(*model.bodies[i].links, state.bodies[owner_of(model, i)].tissue.position, model.bodies[i].surface.vertices,
                             scratch.frames, scratch.surface_ahead);
        }
        if (!model.bodies[i].closed || model.contact.solid_response != SolidResponse::Surface) continue;
        context.bodies[i].inside = InsideTest(model.bodies[i].surface);
        vertices += model.bodies[i].surface.vertices.size();
        context.bodies[i].inside.refit(state.bodies[i].surface);
        const spheretree::SphereTree& tree = model.bodies[i].covering.tree;
        context.bodies[i].leaf_of_triangle.assign(model.bodies[i].surface.triangles.size(), kNoIndex);
        for (Index s = 0; s < tree.sphere_count(); ++s)
            if (tree.is_leaf(s))
                for (const Index t : tree.items_of(s)) context.bodies[i].leaf_of_triangle[t] = s;
    }
    for (std::vector<SolidEntry>* entries : {&context.solids.entries, &context.solids.entries_before}) entries->reserve(vertices);
    for (std::vector<SprungPlace>* places : {&context.solids.sprung, &context.solids.sprung_before}) places->reserve(vertices);
    context.solids.pressed.reserve(vertices);
    context.solids.meeting.reserve(std::min<std::size_t>(model.bodies.size() * (model.bodies.size() + 1) / 2, kReservedPairs));
}

void add_solid_pairs(const SceneModel& model, StepContext& context) {
    SolidScratch& solids = context.solids;
    solids.boxes.assign(model.bodies.size(), Box3{});
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!has_spheres(context, i)) continue;
        const spheretree::Sphere& root = sphere_of(i, 0, context);
        if (root.radius < 0.0) continue;
        solids.boxes[i].add(root.centre);
        solids.boxes[i].inflate(root.radius + model.contact.margin);
    }
    solids.sweep.find_pairs(solids.boxes, solids.near);
    for (const auto& [i, j] : solids.near)
        if (are_solid_pair(model, i, j))
            context.descent.add_solid_pair(view_solid(model, i, context), view_solid(model, j, context));
        else
            context.report.unproven_solids += are_nested(model, i, j);
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (touches_itself(model, i)) {
            context.report.effects.note(Effect::SelfContact);
            context.descent.add_self_pair(view_solid(model, i, context));
        }
}

void push_solids(const SceneModel& model, const State& state, StepContext& context) {
    context.solids.springs.clear();
    find_touches(model, state, context);
    auto pressed = context.solids.pressed.begin();
    for (std::size_t k = 0; k < context.solids.touches.size(); ++k) {
        const Contact& touch = context.solids.touches[k];
        const bool is_pressed = pressed != context.solids.pressed.end() && pressed->touch == k;
        const double gap = is_pressed ? -(pressed++)->pushed : find_start_gap(model, context.solids, touch);
        push_touch(model, touch, gap, state, context);
        context.report.solid_touches += touch.gap <= 0.0;
        note_depth(touch, context);
    }
    sort_memory(context.solids);
    push_spheres(model, state, context);
    context.report.held_pairs = context.solids.holds.size();
}

double find_residual(const SceneModel& model, const State& state, const StepContext& context) {
    Vec3 sum = Vec3::Zero();
    for (const SpringPair& pair : context.solids.springs) {
        if (pair.spring_a == kNoIndex || pair.spring_b == kNoIndex) continue; // what stands still takes any force
        sum += (force_of(model, pair.body_a, pair.spring_a, state, context) - force_of(model, pair.body_b, pair.spring_b, state, context)) *
               pair.normal;
    }
    return sum.norm();
}

} // namespace seldinger::engine
