#include "engine/step/solid/hold_left.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/choose_surfaces.hpp"
#include "engine/step/solid/touch_rules.hpp"
#include "engine/step/tissue/surface_place.hpp"

#include <algorithm>
#include <optional>
#include <tuple>

namespace trocar::engine {

namespace {

/// Places where two bodies press on one another that make a whole patch. Where a step looked at their surfaces and knows so many, these say how the two
/// stand, and what the budget left beside them does not hold the bodies as wholes: two_organs under 4 ms had
/// a force error of 0.94, and has 0.5 to 0.75 (`trocar cost`, from run to run). Without the holds whatever is known, bodies pass through one another.
constexpr std::ptrdiff_t kWidePatch = 32;

Vec3 centre_of(const Triangle& t, const std::vector<Vec3>& surface) { return (surface[t[0]] + surface[t[1]] + surface[t[2]]) / 3.0; }

/// The triangle beneath a leaf whose middle is nearest.
const Triangle& find_nearest(const SceneModel& model, const State& state, std::size_t body, Index leaf, const Vec3& to) {
    const BodyModel& own = model.bodies[body];
    const std::span<const Index> items = own.covering.tree.items_of(leaf);
    const auto distance = [&](Index t) { return (centre_of(own.surface.triangles[t], state.bodies[body].surface) - to).squaredNorm(); };
    return own.surface.triangles[*std::min_element(items.begin(), items.end(), [&](Index x, Index y) { return distance(x) < distance(y); })];
}

/// Two triangles beneath the leaves of a contact of spheres that are near one another.
struct Facing {
    const Triangle &a, &b;
};
Facing find_facing(const SceneModel& model, const State& state, const Contact& spheres) {
    const Triangle& a = find_nearest(model, state, spheres.a.index(), spheres.feature_a[0], spheres.point);
    const Vec3 middle = centre_of(a, state.bodies[spheres.a.index()].surface);
    return {a, find_nearest(model, state, spheres.b.index(), spheres.feature_b[0], middle)};
}

/// The contact of spheres as one of a vertex of the first triangle with the middle of the second.
Contact place_on(const State& state, const Facing& facing, const Contact& spheres) {
    Contact place = spheres;
    place.point = centre_of(facing.b, state.bodies[spheres.b.index()].surface);
    place.feature_a[0] = *std::min_element(facing.a.begin(), facing.a.end());
    for (std::size_t c = 0; c < 3; ++c) place.feature_b[c] = facing.b[c], place.bary_b[c] = 1.0 / 3.0;
    return place;
}

/// Nothing: the two do not look at each other there.
std::optional<Contact> hold_leaves(const SceneModel& model, const State& state, const Contact& spheres) {
    const Facing facing = find_facing(model, state, spheres);
    const auto normal_of = [&](const Triangle& t, std::size_t body) { return spheretree::direction_of(twice_area(t, state.bodies[body].surface)); };
    const Vec3 normal = normal_of(facing.b, spheres.b.index());
    if (!(normal_of(facing.a, spheres.a.index()).dot(normal) < kFacing)) return std::nullopt;
    Contact held = place_on(state, facing, spheres);
    held.origin = ContactOrigin::AssumedSpheres;
    held.normal = normal;
    held.gap = 0.0;
    return held;
}

/// Two bodies as wholes: their first triangles stand for them.
Contact hold_whole(const SceneModel& model, const State& state, const Contact& spheres) {
    const auto first = [&](std::size_t body) -> const Triangle& { return model.bodies[body].surface.triangles.front(); };
    Contact held = place_on(state, {first(spheres.a.index()), first(spheres.b.index())}, spheres);
    held.origin = ContactOrigin::AssumedSpheres;
    held.point = spheres.point;
    held.gap = 0.0;
    return held;
}

/// Of places from `first` on that are the same on the first body, the one that `better` puts first.
template <class Better>
void keep_one_each(std::vector<Contact>& places, std::size_t first, Better&& better) {
    const auto from = places.begin() + static_cast<std::ptrdiff_t>(first);
    std::sort(from, places.end(), [&](const Contact& x, const Contact& y) {
        return x.feature_a[0] != y.feature_a[0] ? x.feature_a[0] < y.feature_a[0] : better(x) < better(y);
    });
    const auto same = [](const Contact& x, const Contact& y) { return x.feature_a[0] == y.feature_a[0]; };
    places.erase(std::unique(from, places.end(), same), places.end());
}

} // namespace

void hold_what_is_left(const SceneModel& model, const State& state, SolidScratch& solids, StepReport& report) {
    if (solids.left_bodies.empty()) return;
    const std::span<const Contact> coarse = solids.coarse;
    std::vector<Index>& held = solids.held;
    const auto deeper = [&](Index x, Index y) { return coarse[x].gap != coarse[y].gap ? coarse[x].gap < coarse[y].gap : x < y; };
    const auto is_leaf = [&](Index k) { return is_leaf_pair(model, coarse[k]); };
    for_each_two_bodies(coarse, [&](Index begin, Index end) {
        const auto [a, b] = bodies_of(coarse[begin]);
        if (a == b || !is_between_bodies(coarse[begin]) || !meet_by_surface(model, a, b)) return;
        if (!std::binary_search(solids.left_bodies.begin(), solids.left_bodies.end(), bodies_of(coarse[begin]))) return;
        const bool all = !is_looked(solids, a, b);
        held.clear();
        for (Index k = begin; k < end; ++k)
            if (coarse[k].gap < 0.0 && (all || is_left(solids, coarse[k]))) held.push_back(k);
        if (held.empty()) return;
        const auto pairs = std::min<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(held.size()), kMostHeld);
        std::nth_element(held.begin(), held.begin() + (pairs - 1), held.end(), deeper);
        const std::size_t first = solids.touches.size();
        const auto pressing = std::count_if(solids.touches.begin(), solids.touches.end(), [&, a = a, b = b](const Contact& touch) {
            return is_touching(touch) && ((touch.a.index() == a && touch.b.index() == b) || (touch.a.index() == b && touch.b.index() == a));
        });
        const bool have_met = !all && pressing >= kWidePatch;
        for (std::ptrdiff_t p = 0; p < pairs; ++p)
            if (is_leaf(held[static_cast<std::size_t>(p)]))
                if (const auto place = hold_leaves(model, state, coarse[held[static_cast<std::size_t>(p)]])) solids.touches.push_back(*place);
        keep_one_each(solids.touches, first, [](const Contact& c) { return std::tie(c.feature_b[0], c.feature_b[1], c.feature_b[2]); });
        if (!have_met && (!std::all_of(held.begin(), held.end(), is_leaf) || solids.touches.size() == first))
            solids.wholes.push_back(hold_whole(model, state, coarse[*std::min_element(held.begin(), held.end(), deeper)]));
        report.held_pairs += static_cast<std::uint64_t>(pairs);
    });
}

void press_spheres(const SceneModel& model, const State& state, SolidScratch& solids, StepReport& report) {
    const std::span<const Contact> coarse = solids.coarse;
    std::vector<Contact>& places = solids.sphere_places;
    places.clear();
    for_each_two_bodies(coarse, [&](Index begin, Index end) {
        const auto [a, b] = bodies_of(coarse[begin]);
        if (a == b || !is_between_bodies(coarse[begin]) || meet_by_surface(model, a, b)) return;
        std::vector<Index>&of_a = solids.bodies[a].deepest, &of_b = solids.bodies[b].deepest;
        of_a.assign(model.bodies[a].covering.tree.sphere_count(), kNoIndex);
        of_b.assign(model.bodies[b].covering.tree.sphere_count(), kNoIndex);
        Index open = kNoIndex;
        const auto note = [&](Index& deepest, Index k) {
            if (deepest == kNoIndex || coarse[k].gap < coarse[deepest].gap) deepest = k;
        };
        for (Index k = begin; k < end; ++k) {
            if (!(coarse[k].gap < 0.0)) continue;
            if (!is_leaf_pair(model, coarse[k])) {
                note(open, k);
                continue;
            }
            note(of_a[coarse[k].feature_a[0]], k);
            note(of_b[coarse[k].feature_b[0]], k);
        }
        const std::size_t first = places.size();
        for (Index k = begin; k < end; ++k)
            if (coarse[k].gap < 0.0 && is_leaf_pair(model, coarse[k]) && (of_a[coarse[k].feature_a[0]] == k || of_b[coarse[k].feature_b[0]] == k))
                places.push_back(place_on(state, find_facing(model, state, coarse[k]), coarse[k]));
        keep_one_each(places, first, [](const Contact& c) { return std::tuple(c.gap, c.feature_b[0], c.feature_b[1]); });
        report.held_pairs += places.size() - first + (open != kNoIndex);
        if (open != kNoIndex) solids.wholes.push_back(hold_whole(model, state, coarse[open]));
    });
}

} // namespace trocar::engine
