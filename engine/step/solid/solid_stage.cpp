#include "engine/step/solid/solid_stage.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/hold_left.hpp"
#include "engine/step/solid/self_touch.hpp"
#include "engine/step/solid/contact_response.hpp"
#include "engine/step/solid/edge_touch.hpp"
#include "engine/step/solid/solid_passage.hpp"
#include "engine/step/solid/choose_surfaces.hpp"
#include "engine/step/solid/solid_touch.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/solid/touch_rules.hpp"
#include "engine/effects/registry.hpp"
#include "engine/step/solid/surface_travel.hpp"
#include "engine/time/phase.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Pairs of bodies that the list of those who meet holds without growing.
constexpr std::size_t kReservedPairs = 4096;
/// Of a triangle's extent: surfaces of solids are asked for many places in a step.
constexpr double kLoosest = 0.1;

} // namespace

void prepare_solids(const SceneModel& model, const State& state, SolidScratch& solids) {
    solids.bodies.resize(model.bodies.size());
    std::size_t places = 0; // of closed bodies that something can touch
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!can_touch_any(model, i)) continue;
        solids.bodies[i].thickness = find_thickness(model.bodies[i].surface.vertices);
        if (!meet_by_surface(model, i, i)) continue;
        solids.bodies[i].inside = InsideTest(model.bodies[i].surface);
        solids.bodies[i].adjacency = make_adjacency(model.bodies[i].topology);
        places += reserved_places(model.bodies[i]);
        InsideTest& inside = solids.bodies[i].inside;
        model.bodies[i].moves() ? inside.start_following(state.bodies[i].surface, kLoosest) : inside.refit(state.bodies[i].surface);
        const spheretree::SphereTree& tree = model.bodies[i].covering.tree;
        solids.bodies[i].leaf_of_triangle.assign(model.bodies[i].surface.triangles.size(), kNoIndex);
        for (Index s = 0; s < tree.sphere_count(); ++s)
            if (tree.is_leaf(s))
                for (const Index t : tree.items_of(s)) solids.bodies[i].leaf_of_triangle[t] = s;
        solids.bodies[i].sharp = list_sharp_edges(model.bodies[i]);
    }
    solids.entries_before.reserve(places);
    solids.contacts_before.reserve(places);
    solids.forces_t0.reserve(places);
    solids.pressed.reserve(places);
    solids.touches.reserve(places);
    for (std::vector<Piercing>& piercings : solids.piercings) piercings.reserve(places);
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
            report.effects.note(effects::self_contact);
            descent.add_self_pair(view_self(model, i, solids));
        }
}

void push_solids(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report, StepBudget& budget) {
    std::swap(state.solids.contacts, solids.contacts_before);
    state.solids.contacts.clear();
    budget.keep_back(std::max(budget.forecast(StepPart::Holds).recent_s(), budget.holding_s(solids.coarse.size())));
    find_touches(model, state, solids, report, budget);
    Phase holding(budget, StepPart::Holds);
    list_what_is_left(model, state, solids, report);
    solids.wholes.clear();
    hold_what_is_left(model, state, solids, report);
    ContactSink sink{model, state, solids, report};
    response_of(model.contact.solid_response).respond(solids.touches, sink);
    for (const Contact& whole : solids.wholes) sink.hold(whole);
    std::sort(state.solids.contacts.begin(), state.solids.contacts.end(),
              [](const SolidContact& x, const SolidContact& y) { return x.key() < y.key(); });
    holding.end();
    budget.learn_holding(solids.coarse.size());
    for (const SolidContact& place : state.solids.contacts) 
        report.solid_touches += is_touching(place.touch) && place.touch.origin == ContactOrigin::Proximity;
}

} // namespace trocar::engine
