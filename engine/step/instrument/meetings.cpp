// Instruments that meet one another: which of them are solved together in a step, and what is told of it.
#include "engine/effects/registry.hpp"
#include "engine/step/instrument/instrument_stage.hpp"

#include <algorithm>

namespace trocar::engine {

/// The instruments that may be solved together, from where the step started to where they are.
static std::span<const fem::MovedRod> moved_rods(const SceneModel& model, const State& state, const RodsScratch& rods,
                                                 std::array<fem::MovedRod, fem::kMostTogether>& list) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const InstrumentModel& instrument = model.instruments[i];
        const bool meets = rods.meet_outside && meets_instruments(instrument);
        if (!meets && !has_play(instrument)) continue;
        const fem::RodState& now = state.instruments[i].rod;
        list[count++] = {static_cast<Index>(i), instrument.lumen, &instrument.rod, rods.instruments[i].rod_t0.position, now.position,
                         fem::first_inserted_node(instrument.rod, now.insertion), now.insertion,
                         instrument.play > 0.0 ? static_cast<Index>(*instrument.inside) : kNoIndex, instrument.play, meets};
    }
    return std::span(list).first(count);
}

void begin_meetings(const SceneModel& model, const EffectSet& live, State& state, RodsScratch& rods, StepReport& report) {
    rods.meet_outside = live.instrument_contact && has_effect(model, effects::instrument_contact);
    rods.meet = rods.meet_outside || std::any_of(model.instruments.begin(), model.instruments.end(), has_play);
    rods.together.clear();
    if (!rods.meet) {
        state.meetings.clear();
        return;
    }
    if (rods.meet_outside) report.effects.note(effects::instrument_contact);
    if (!rods.meet_outside) std::erase_if(state.meetings, [](const fem::RodMeeting& m) { return m.play == 0.0; });
    for (std::size_t i = 0; i < model.instruments.size(); ++i) // what met in the last step looks ahead together
        if (has_play(model.instruments[i]) || std::any_of(state.meetings.begin(), state.meetings.end(), [&](const fem::RodMeeting& m) { return m.rod == i || m.other_rod == i; }))
            rods.together.push_back(i);
}

void find_meetings(const SceneModel& model, State& state, RodsScratch& rods) {
    if (!rods.meet) return;
    std::array<fem::MovedRod, fem::kMostTogether> list;
    const auto moved = moved_rods(model, state, rods, list);
    rods.meetings.begin(moved, model.step_s);
    rods.meetings.list_planes(moved, state.meetings);
    rods.together.clear();
    for (std::size_t k = 0; k < moved.size(); ++k)
        if (rods.meetings.may_meet(k)) rods.together.push_back(moved[k].id);
}

bool check_meetings(const SceneModel& model, State& state, RodsScratch& rods) {
    std::array<fem::MovedRod, fem::kMostTogether> list;
    const bool settled = std::all_of(rods.together.begin(), rods.together.end(), [&](std::size_t i) { return rods.instruments[i].rod_report.unconverged == 0; });
    return rods.meetings.check(moved_rods(model, state, rods, list), settled, state.meetings);
}

double find_met_share(const SceneModel& model, const State& state, RodsScratch& rods) {
    if (!rods.meet) return 1.0;
    std::array<fem::MovedRod, fem::kMostTogether> list;
    return rods.meetings.find_proven_share(moved_rods(model, state, rods, list));
}

static Vec3 on_axis(const fem::RodState& rod, Index node, double weight) {
    return (1.0 - weight) * rod.position[node] + weight * rod.position[node + 1];
}

void list_meetings(const SceneModel& model, const State& state, ContactOrigin origin, std::vector<Contact>& contacts) {
    for (const fem::RodMeeting& meeting : state.meetings) {
        const auto& [plane, rod, other_rod, play, along, beside] = meeting;
        if (!(plane.force > 0.0)) continue;
        Contact contact;
        contact.a = Thing::instrument(rod), contact.b = Thing::instrument(other_rod);
        contact.origin = origin;
        contact.normal = plane.normal;
        const Vec3 one = on_axis(state.instruments[rod].rod, plane.node, plane.weight);
        const Vec3 two = on_axis(state.instruments[other_rod].rod, plane.other, plane.other_weight);
        const double ra = model.instruments[rod].rod.design.radius, rb = model.instruments[other_rod].rod.design.radius;
        contact.gap = play > 0.0 ? play + plane.normal.dot(one - two + beside) : plane.normal.dot(one - two) - ra - rb;
        contact.force = plane.force * plane.normal + plane.drag;
        contact.point = play > 0.0 ? Vec3(one - ra * plane.normal) : Vec3((rb * one + ra * two) / (ra + rb));
        contact.feature_a[0] = plane.node;
        contact.feature_b[0] = plane.other;
        contact.bary_a[0] = 1.0 - plane.weight, contact.bary_a[1] = plane.weight;
        contact.bary_b[0] = 1.0 - plane.other_weight, contact.bary_b[1] = plane.other_weight;
        contacts.push_back(contact);
    }
}

} // namespace trocar::engine
