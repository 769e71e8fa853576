#include "engine/step/solid/hold_left.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/prepare/thing.hpp"
#include "engine/step/solid/solid_touch.hpp"
#include "engine/step/solid/touch_rules.hpp"
#include "engine/step/tissue/surface_place.hpp"

#include <algorithm>
#include <optional>
#include <tuple>

namespace trocar::engine {

namespace {

Vec3 centre_of(const Triangle& t, const std::vector<Vec3>& surface) { return (surface[t[0]] + surface[t[1]] + surface[t[2]]) / 3.0; }

/// The triangle beneath a leaf whose middle is nearest.
Index find_nearest(const SceneModel& model, const State& state, std::size_t body, Index leaf, const Vec3& to) {
    Index best = kNoIndex;
    double least = std::numeric_limits<double>::infinity();
    for (const Index t : model.bodies[body].covering.tree.items_of(leaf)) {
        const double distance = (centre_of(model.bodies[body].surface.triangles[t], state.bodies[body].surface) - to).squaredNorm();
        if (distance < least || best == kNoIndex) least = distance, best = t;
    }
    return best;
}

Contact hold_pair(const Contact& spheres) {
    Contact held;
    held.body_a = spheres.body_a, held.body_b = spheres.body_b;
    held.origin = ContactOrigin::AssumedSpheres;
    held.normal = spheres.normal;
    return held;
}

/// Vertex and triangle beneath two leaves that are nearest to one another.
Contact place_between(const SceneModel& model, const State& state, const Contact& spheres) {
    const std::vector<Vec3>&at_a = state.bodies[spheres.body_a].surface, &at_b = state.bodies[spheres.body_b].surface;
    const Index of_a = find_nearest(model, state, spheres.body_a, spheres.feature_a[0], spheres.point);
    const Triangle& ta = model.bodies[spheres.body_a].surface.triangles[of_a];
    const Index of_b = find_nearest(model, state, spheres.body_b, spheres.feature_b[0], centre_of(ta, at_a));
    const Triangle& tb = model.bodies[spheres.body_b].surface.triangles[of_b];
    Contact held = hold_pair(spheres);
    held.point = centre_of(tb, at_b);
    held.feature_a[0] = *std::min_element(ta.begin(), ta.end());
    for (std::size_t c = 0; c < 3; ++c) held.feature_b[c] = tb[c], held.bary_b[c] = 1.0 / 3.0;
    return held;
}

/// Nothing: the two do not look at each other there.
std::optional<Contact> hold_leaves(const SceneModel& model, const State& state, const Contact& spheres) {
    Contact held = place_between(model, state, spheres);
    const std::vector<Vec3>&at_a = state.bodies[spheres.body_a].surface, &at_b = state.bodies[spheres.body_b].surface;
    const Index of_a = find_nearest(model, state, spheres.body_a, spheres.feature_a[0], spheres.point);
    held.normal = spheretree::direction_of(twice_area({held.feature_b[0], held.feature_b[1], held.feature_b[2]}, at_b));
    const Vec3 own = spheretree::direction_of(twice_area(model.bodies[spheres.body_a].surface.triangles[of_a], at_a));
    if (!(own.dot(held.normal) < kFacing)) return std::nullopt;
    return held;
}

/// Two bodies as wholes: a contact of an edge's two vertices stands for that (ContactRow::is_whole).
Contact hold_wholes(const SceneModel& model, const Contact& spheres) {
    Contact held = hold_pair(spheres);
    const auto first_triangle = [&](std::size_t body, Index sphere) {
        return model.bodies[body].surface.triangles[model.bodies[body].covering.tree.items_of(sphere).front()];
    };
    const Triangle a = first_triangle(spheres.body_a, 0), b = first_triangle(spheres.body_b, 0);
    for (std::size_t c = 0; c < 2; ++c) held.feature_a[c] = a[c], held.bary_a[c] = 0.5;
    for (std::size_t c = 0; c < 3; ++c) held.feature_b[c] = b[c], held.bary_b[c] = 1.0 / 3.0;
    held.point = spheres.point;
    return held;
}

} // namespace

void hold_what_is_left(const SceneModel& model, const State& state, SolidScratch& solids, StepReport& report) {
    const auto order_of = [](const Contact& c) { return std::tie(c.feature_a[0], c.feature_a[1], c.feature_b[0], c.feature_b[1], c.feature_b[2]); };
    if (solids.left_bodies.empty()) return;
    std::vector<Index>& held = solids.held;
    const auto deeper = [&](Index x, Index y) {
        return solids.coarse[x].gap != solids.coarse[y].gap ? solids.coarse[x].gap < solids.coarse[y].gap : x < y;
    };
    Index begin = 0, end = 0; // contacts of two bodies lie side by side
    for (; begin < solids.coarse.size(); begin = end) {
        const Contact& head = solids.coarse[begin];
        const auto is_of_these = [&](const Contact& c) { return c.body_a == head.body_a && c.body_b == head.body_b; };
        for (end = begin; end < solids.coarse.size() && is_of_these(solids.coarse[end]);) ++end;
        if (!is_between_bodies(model, head) || head.body_a == head.body_b || !meet_by_surface(model, head.body_a, head.body_b)) continue;
        if (!std::binary_search(solids.left_bodies.begin(), solids.left_bodies.end(), std::pair<Index, Index>(head.body_a, head.body_b))) continue;
        const bool all = !is_looked(solids, head.body_a, head.body_b);
        held.clear();
        for (Index k = begin; k < end; ++k)
            if (solids.coarse[k].gap < 0.0 && (all || is_left(solids, solids.coarse[k]))) held.push_back(k);
        if (held.empty()) continue;
        const std::size_t pairs = std::min(held.size(), kMostHeld), first = solids.touches.size();
        std::nth_element(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(pairs - 1), held.end(), deeper);
        const auto is_leaf = [&](Index k) { return is_leaf_pair(model, solids.coarse[k]); };
        const auto wide = std::find_if_not(held.begin(), held.end(), is_leaf);
        for (std::size_t p = 0; p < pairs; ++p)
            if (is_leaf(held[p]))
                if (const auto place = hold_leaves(model, state, solids.coarse[held[p]])) solids.touches.push_back(*place);
        if (wide != held.end() || solids.touches.size() == first)
            solids.touches.push_back(hold_wholes(model, solids.coarse[*std::min_element(held.begin(), held.end(), deeper)]));
        report.held_pairs += pairs;
        // a place holds once
        const auto from = solids.touches.begin() + static_cast<std::ptrdiff_t>(first);
        std::sort(from, solids.touches.end(), [&](const Contact& x, const Contact& y) {
            return order_of(x) < order_of(y);
        });
        solids.touches.erase(std::unique(from, solids.touches.end(), [](const Contact& x, const Contact& y) { return x.feature_a[0] == y.feature_a[0] && x.feature_a[1] == y.feature_a[1]; }),
                             solids.touches.end());
    }
}

void press_spheres(const SceneModel& model, const State& state, SolidScratch& solids, std::vector<Contact>& places) {
    places.clear();
    const auto counts = [&](const Contact& c) {
        return is_between_bodies(model, c) && c.gap < 0.0 && c.body_a != c.body_b && !meet_by_surface(model, c.body_a, c.body_b);
    };
    for (Index begin = 0, end = 0; begin < solids.coarse.size(); begin = end) {
        const std::size_t a = solids.coarse[begin].body_a, b = solids.coarse[begin].body_b;
        for (end = begin; end < solids.coarse.size() && solids.coarse[end].body_a == a && solids.coarse[end].body_b == b;) ++end;
        if (!counts(solids.coarse[begin]) && std::none_of(solids.coarse.begin() + begin, solids.coarse.begin() + end, counts)) continue;
        for (const std::size_t body : {a, b}) solids.bodies[body].deepest.assign(model.bodies[body].covering.tree.sphere_count(), kNoIndex);
        Index open = kNoIndex;
        const auto deeper = [&](Index k, Index than) { return than == kNoIndex || solids.coarse[k].gap < solids.coarse[than].gap; };
        for (Index k = begin; k < end; ++k) {
            const Contact& contact = solids.coarse[k];
            if (!counts(contact)) continue;
            if (!is_leaf_pair(model, contact)) {
                if (deeper(k, open)) open = k;
                continue;
            }
            for (Index* best : {&solids.bodies[a].deepest[contact.feature_a[0]], &solids.bodies[b].deepest[contact.feature_b[0]]})
                if (deeper(k, *best)) *best = k;
        }
        const std::size_t first = places.size();
        for (Index k = begin; k < end; ++k) {
            const Contact& contact = solids.coarse[k];
            if (!counts(contact) || !is_leaf_pair(model, contact)) continue;
            if (solids.bodies[a].deepest[contact.feature_a[0]] != k && solids.bodies[b].deepest[contact.feature_b[0]] != k) continue;
            places.push_back(place_between(model, state, contact));
            places.back().origin = contact.origin;
            places.back().normal = contact.normal;
            places.back().gap = contact.gap;
        }
        const auto from = places.begin() + static_cast<std::ptrdiff_t>(first);
        std::sort(from, places.end(), [](const Contact& x, const Contact& y) {
            return std::tie(x.feature_a[0], x.gap, x.feature_b[0], x.feature_b[1]) < std::tie(y.feature_a[0], y.gap, y.feature_b[0], y.feature_b[1]);
        });
        places.erase(std::unique(from, places.end(), [](const Contact& x, const Contact& y) { return x.feature_a[0] == y.feature_a[0]; }), places.end());
        if (open != kNoIndex) places.push_back(hold_wholes(model, solids.coarse[open]));
    }
}

} // namespace trocar::engine
