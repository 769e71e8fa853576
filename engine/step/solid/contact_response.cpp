#include "engine/step/solid/contact_response.hpp"

#include "engine/effects/registry.hpp"
#include "engine/step/solid/hold_left.hpp"
#include "engine/step/solid/solid_passage.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// s, m/s; what lies in another body by rounding, or because it came unseen, is pushed out in that time, and no faster: it gains what the
/// load does on that way, and must not be thrown.
constexpr double kSettlingTime = 0.05, kSettling = 2e-3;

/// m; a sheet has no thickness.
constexpr double kLeastRoom = 1e-6;

/// Of the last response; nullptr: there was no such place.
const SolidContact* find_before(const SolidScratch& solids, const SolidContact& place) noexcept {
    const std::vector<SolidContact>& before = solids.contacts_before;
    const auto found = std::lower_bound(before.begin(), before.end(), place,
                                        [](const SolidContact& x, const SolidContact& y) { return x.key() < y.key(); });
    return found != before.end() && found->key() == place.key() ? &*found : nullptr;
}

void note_depth(const Contact& touch, const SolidScratch& solids, StepReport& report) {
    report.deepest_touch_m = std::max(report.deepest_touch_m, -touch.gap);
    if (touch.a == touch.b) return;
    const double thinner = std::min(solids.bodies[touch.a.index()].thickness, solids.bodies[touch.b.index()].thickness);
    if (thinner > 0.0) report.deepest_share = std::max(report.deepest_share, -touch.gap / thinner);
}

double recovery_of(const Contact& touch) { return std::clamp(-touch.gap / kSettlingTime, 0.0, kSettling); }

/// Places at the depths of spheres, where surfaces do not say.
void add_spheres(ContactSink& sink) {
    press_spheres(sink.model, sink.state, sink.solids, sink.report);
    for (const Contact& place : sink.solids.sphere_places) sink.add(place, recovery_of(place));
}

/// Impulses at places of the surfaces, and of spheres where a body has no inside.
class SurfaceResponse final : public ContactResponse {
public:
    void respond(std::span<const Contact> contacts, ContactSink& sink) const override {
        auto pressed = sink.solids.pressed.begin();
        for (std::size_t k = 0; k < contacts.size(); ++k) {
            const bool is_pressed = pressed != sink.solids.pressed.end() && *pressed == k;
            pressed += is_pressed;
            sink.add(contacts[k], is_pressed ? kRecovery : recovery_of(contacts[k]));
        }
        add_spheres(sink);
    }
};

class SphereResponse final : public ContactResponse {
public:
    void respond(std::span<const Contact>, ContactSink& sink) const override { add_spheres(sink); }
};

} // namespace

void ContactSink::add(const Contact& touch, double recovery) {
    SolidContact place{touch, recovery};
    if (const SolidContact* before = find_before(solids, place)) {
        place.touch.force = before->touch.force;
        place.warm = before->warm;
    }
    if (touch.origin == ContactOrigin::Proximity) note_depth(touch, solids, report);
    if (model.contact.solid_friction > 0.0) report.effects.note(effects::friction);
    state.solids.contacts.push_back(place);
}

void ContactSink::hold(const Contact& whole) {
    SolidContact place{whole};
    place.room = std::max(kLeastRoom, 0.5 * std::min(solids.bodies[whole.a.index()].thickness, solids.bodies[whole.b.index()].thickness));
    state.solids.contacts.push_back(place);
}

const ContactResponse& response_of(SolidResponse response) noexcept {
    static const SurfaceResponse surface;
    static const SphereResponse spheres;
    if (response == SolidResponse::Spheres) return spheres;
    return surface;
}

} // namespace trocar::engine
