#include "engine/step/solid/contact_response.hpp"

#include "engine/effects/registry.hpp"
#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/solid_hold.hpp"
#include "engine/step/solid/spring_memory.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// [-]; friction's springs are damped by so much of what would be critical for the nodes beneath one place, without which what rests would
/// go on shivering on them. Several places hang on a node: together they come near to critical, and need no shorter stable step.
constexpr double kFrictionDamping = 0.1;

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
void hold_against_slip(const Contact& touch, const Place& a, const Place& b, SpringSink& sink, WarmStartSpring& own) {
    const auto& [model, state, solids, report] = sink;
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
        sink.push(a, b,
                  {.direction = direction,
                   .gap = gap,
                   .stiffness = contact.solid_stiffness,
                   .damping = damping,
                   .friction = contact.solid_friction,
                   .under = &load});
}

/// gap: m, that its springs start with
void push_touch(const Contact& touch, double gap, SpringSink& sink) {
    const ContactSpec& contact = sink.model.contact;
    const std::size_t corners = touch.feature_a[1] == kNoIndex ? 1 : 2;
    const Place a{touch.body_a, std::span(touch.feature_a).first(corners), std::span(touch.bary_a).first(corners)};
    const Place b{touch.body_b, touch.feature_b, touch.bary_b};
    sink.push(a, b, {touch.normal, gap, contact.solid_stiffness, contact.solid_damping});
    WarmStartSpring of_edge; // forgotten: it holds from the slip of the last step on
    of_edge.pressed = std::max(0.0, -gap);
    WarmStartSpring* own = store_warm_spring(touch, gap, sink.state.solids);
    if (!(contact.solid_friction > 0.0)) return;
    sink.report.effects.note(effects::friction);
    hold_against_slip(touch, a, b, sink, own != nullptr ? *own : of_edge);
}

void note_depth(const Contact& touch, const SolidScratch& solids, StepReport& report) {
    report.deepest_touch_m = std::max(report.deepest_touch_m, -touch.gap);
    if (touch.body_a == touch.body_b) return;
    const double thinner = std::min(solids.bodies[touch.body_a].thickness, solids.bodies[touch.body_b].thickness);
    if (thinner > 0.0) report.deepest_share = std::max(report.deepest_share, -touch.gap / thinner);
}

/// Springs along the normals, started from what the last step's held, and along the surface under friction.
class SurfaceResponse final : public ContactResponse {
public:
    void respond(std::span<const Contact> contacts, SpringSink& sink) const override {
        auto pressed = sink.solids.pressed.begin();
        for (std::size_t k = 0; k < contacts.size(); ++k) {
            const Contact& touch = contacts[k];
            const bool is_pressed = pressed != sink.solids.pressed.end() && pressed->touch == k;
            const double gap = is_pressed ? -(pressed++)->pushed : find_start_gap(sink.model, sink.solids, touch);
            push_touch(touch, gap, sink);
            sink.report.solid_touches += touch.gap <= 0.0;
            note_depth(touch, sink.solids, sink.report);
        }
        sort_memory(sink.state.solids);
        push_spheres(sink.model, sink.state, sink.solids);
    }
};

class SphereResponse final : public ContactResponse {
public:
    void respond(std::span<const Contact>, SpringSink& sink) const override { push_spheres(sink.model, sink.state, sink.solids); }
};

} // namespace

const ContactResponse& response_of(SolidResponse response) noexcept {
    static const SurfaceResponse surface;
    static const SphereResponse spheres;
    if (response == SolidResponse::Spheres) return spheres;
    return surface;
}

} // namespace trocar::engine
