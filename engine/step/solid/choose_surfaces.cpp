#include "engine/step/solid/choose_surfaces.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/edge_touch.hpp"
#include "engine/step/solid/solid_probe.hpp"
#include "engine/step/solid/surface_travel.hpp"
#include "engine/step/solid/touch_rules.hpp"
#include "engine/step/tissue/surface_place.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace trocar::engine {

namespace {

/// In a sorted list.
std::optional<std::size_t> place_in(const std::vector<std::pair<Index, Index>>& list, const std::pair<Index, Index>& bodies) noexcept {
    const auto at = std::lower_bound(list.begin(), list.end(), bodies);
    if (at == list.end() || *at != bodies) return std::nullopt;
    return static_cast<std::size_t>(at - list.begin());
}

/// What depths are measured with in this step, once for all bodies that one meets.
void refresh(const SceneModel& model, const State& state, std::size_t body, SolidScratch& solids) {
    SolidBodyScratch& scratch = solids.bodies[body];
    if (scratch.surface_is_fresh) return;
    scratch.surface_is_fresh = true;
    if (model.bodies[body].moves()) {
        scratch.inside.follow_loosely(state.bodies[body].surface);
        scratch.motion = find_motion(scratch.surface_t0, state.bodies[body].surface);
    }
}

/// The trees of two bodies where they may meet.
void renew_between(const SceneModel& model, std::size_t a, std::size_t b, SolidScratch& solids) {
    SolidBodyScratch &one = solids.bodies[a], &other = solids.bodies[b];
    const double reach = model.contact.margin + find_relative_way(one.motion, other.motion);
    Box3 around_one = one.inside.tree().bounds(), around_other = other.inside.tree().bounds();
    around_one.inflate(reach);
    around_other.inflate(reach);
    one.inside.renew_within(around_other);
    if (a != b) other.inside.renew_within(around_one);
}

/// Bodies whose surfaces there is reason to look at in this step, each two once.
void list_meeting(const SceneModel& model, SolidScratch& solids) {
    std::vector<std::pair<Index, Index>>& meeting = solids.meeting;
    meeting.clear();
    const auto add = [&](std::size_t a, std::size_t b) {
        const std::pair<Index, Index> bodies{static_cast<Index>(std::min(a, b)), static_cast<Index>(std::max(a, b))};
        if (meeting.empty() || meeting.back() != bodies) meeting.push_back(bodies);
    };
    for (const Contact& contact : solids.coarse)
        if (is_between_bodies(contact) &&
            meet_by_surface(model, contact.a.index(), contact.b.index()))
            add(contact.a.index(), contact.b.index());
    for (const SolidEntry& entry : solids.entries_before) add(entry.own, entry.other);
    for (const LeafPair& pair : solids.touching_before) // looked at again whatever the descent says
        if (pair.a == pair.b) add(pair.a, pair.b);
    std::sort(meeting.begin(), meeting.end());
    meeting.erase(std::unique(meeting.begin(), meeting.end()), meeting.end());
}

std::uint64_t surface_units(const SceneModel& model, std::size_t body) {
    return model.bodies[body].moves() ? kUnitsPerSurfaceTriangle * model.bodies[body].surface.triangles.size() : 0;
}

/// Units of leaves without which it does not pay to make surfaces ready.
constexpr std::uint64_t kLeastLooked = 20 * kUnitsPerLeafTriangle;

std::uint64_t units_beneath(const SceneModel& model, const LeafPair& pair, const SolidScratch& solids) {
    const std::uint64_t edges =
        pair.a == pair.b ? 0 : edge_units(solids.bodies[pair.a].sharp, pair.leaf_a, solids.bodies[pair.b].sharp, pair.leaf_b);
    return edges + kUnitsPerLeafTriangle * (model.bodies[pair.a].covering.tree.items_of(pair.leaf_a).size() +
                                            model.bodies[pair.b].covering.tree.items_of(pair.leaf_b).size());
}

/// Of the leaves beneath which the two touched in the last step.
std::uint64_t leaf_units_before(const SceneModel& model, std::size_t a, std::size_t b, const SolidScratch& solids) {
    const auto before = [](const LeafPair& pair, const std::pair<std::size_t, std::size_t>& bodies) { return std::pair(pair.a, pair.b) < bodies; };
    std::uint64_t units = 0;
    for (auto pair = std::lower_bound(solids.touching_before.begin(), solids.touching_before.end(), std::pair(a, b), before);
         pair != solids.touching_before.end() && pair->a == a && pair->b == b; ++pair)
        units += units_beneath(model, *pair, solids);
    return units;
}

/// Bodies whose spheres meet, but whose surfaces nobody looks at, or that have no inside: what goes farther than half of the thinner one
/// in a step may be on its other side.
void count_unproven(const SceneModel& model, const State& state, const SolidScratch& solids, StepReport& report) {
    for_each_two_bodies(solids.coarse, [&](Index begin, Index) {
        const auto [a, b] = bodies_of(solids.coarse[begin]);
        if (a == b || !is_between_bodies(solids.coarse[begin]) || meet_by_surface(model, a, b)) return;
        const auto motion_of = [&](std::size_t body) {
            return model.bodies[body].moves() ? find_motion(solids.bodies[body].surface_t0, state.bodies[body].surface) : SurfaceTravel{};
        };
        const double thinner = std::min(solids.bodies[a].thickness, solids.bodies[b].thickness);
        report.unproven_solids += find_relative_way(motion_of(a), motion_of(b)) > 0.5 * thinner;
    });
}

/// m; farthest way of a body in the step, by its coarse nodes: what nobody looks at costs nothing by its surface.
double way_of_nodes(const SceneModel& model, std::size_t body, const State& state, const SolidScratch& solids) {
    if (!model.bodies[body].moves()) return 0.0;
    const SolidBodyScratch& scratch = solids.bodies[body];
    const std::span<const Vec3> now = state.bodies[owner_of(model, body)].tissue.position;
    if (now.empty()) return scratch.surface_t0.empty() ? 0.0 : (state.bodies[body].surface.front() - scratch.surface_t0.front()).norm();
    double farthest = 0.0;
    for (std::size_t n = 0; n < now.size(); ++n) farthest = std::max(farthest, (now[n] - scratch.nodes_t0[n]).squaredNorm());
    return std::sqrt(farthest);
}

} // namespace

void choose_looked(const SceneModel& model, const State& state, SolidScratch& solids, SurfaceAccount& account) {
    for (SolidBodyScratch& body : solids.bodies) body.surface_is_fresh = false;
    solids.left_bodies.clear();
    list_meeting(model, solids);
    solids.looked.assign(solids.meeting.size(), 0);
    std::vector<std::uint8_t>& touched = solids.touched;
    touched.assign(solids.meeting.size(), 0);
    for (const SolidContact& place : solids.contacts_before) {
        if (const auto at = place_in(solids.meeting, std::minmax<Index>({static_cast<Index>(place.touch.a.index()), static_cast<Index>(place.touch.b.index())}))) touched[*at] = 1;
    }
    for (const bool first : {true, false})
        for (std::size_t k = 0; k < solids.meeting.size(); ++k) {
            const auto [a, b] = solids.meeting[k];
            if ((touched[k] != 0) != first) continue;
            std::uint64_t units = kUnitsPerQuery;
            if (!solids.bodies[a].surface_is_fresh) units += surface_units(model, a);
            if (a != b && !solids.bodies[b].surface_is_fresh) units += surface_units(model, b);
            if (!account.take(units, std::max(kLeastLooked, std::min(units, leaf_units_before(model, a, b, solids))))) {
                solids.left_bodies.push_back({a, b});
                continue;
            }
            refresh(model, state, a, solids);
            refresh(model, state, b, solids);
            renew_between(model, a, b, solids);
            account.settle();
            solids.looked[k] = 1;
        }
}

void list_what_is_left(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report) {
    report.left_pairs += solids.left_pairs.size();
    std::sort(solids.left_bodies.begin(), solids.left_bodies.end());
    solids.left_bodies.erase(std::unique(solids.left_bodies.begin(), solids.left_bodies.end()), solids.left_bodies.end());
    for (const auto& [a, b] : solids.left_bodies) {
        if (a == b || is_looked(solids, a, b)) continue; // those that are say it themselves
        const double thinner = std::min(solids.bodies[a].thickness, solids.bodies[b].thickness);
        report.unproven_solids += way_of_nodes(model, a, state, solids) + way_of_nodes(model, b, state, solids) > 0.5 * thinner;
    }
    std::sort(state.solids.entries.begin(), state.solids.entries.end(), kByKey);
    keep_touching(solids, state.solids.touching);
    count_unproven(model, state, solids, report);
}

bool is_looked(const SolidScratch& solids, std::size_t a, std::size_t b) noexcept {
    const std::optional<std::size_t> at = place_in(solids.meeting, {static_cast<Index>(a), static_cast<Index>(b)});
    return at && solids.looked[*at] != 0;
}

bool is_left(const SolidScratch& solids, const Contact& spheres) noexcept {
    const LeafPair pair{spheres.a.index(), spheres.b.index(), spheres.feature_a[0], spheres.feature_b[0]};
    return spheres.origin == ContactOrigin::AssumedSpheres || !std::binary_search(solids.done_pairs.begin(), solids.done_pairs.end(), pair, kByKey);
}

SurfaceNeed forecast_surfaces(const SceneModel& model, const State& state, SolidScratch& solids) {
    std::vector<std::uint8_t>& counted = solids.counted;
    counted.assign(model.bodies.size(), 0);
    SurfaceNeed need;
    for (const SolidContact& place : state.solids.contacts)
        for (const std::size_t body : {place.touch.a.index(), place.touch.b.index()}) {
            if (counted[body] == 0) need.made_ready += surface_units(model, body) + kUnitsPerQuery;
            counted[body] = 1;
        }
    for (const LeafPair& pair : state.solids.touching) need.places += units_beneath(model, pair, solids);
    return need;
}

} // namespace trocar::engine
