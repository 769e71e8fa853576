#include "engine/step/solid/solid_touch.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/carry_touch.hpp"
#include "engine/step/solid/choose_surfaces.hpp"
#include "engine/step/solid/edge_touch.hpp"
#include "engine/step/solid/self_touch.hpp"
#include "engine/step/solid/solid_passage.hpp"
#include "engine/step/solid/solid_probe.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/tissue/surface_place.hpp"
#include "engine/step/solid/surface_travel.hpp"
#include "engine/step/solid/touch_rules.hpp"
#include "engine/step/solid/vertex_touch.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>

namespace trocar::engine {

namespace {

/// Vertices in a step that are looked at because their bodies moved far and the budget left sphere pairs open. A thousand cost about a
/// millisecond; with more, what was not looked at is reported (unproven_solids).
constexpr std::size_t kPathProbes = 4096;

double reach_of(const OneWay& way) {
    const SurfaceTravel& motion = way.solids.bodies[way.other].motion;
    const double farthest = std::min((motion.mean - way.shared()).norm() + motion.spread, motion.farthest + way.shared().norm());
    return way.model.contact.margin + farthest + way.known_change();
}

void probe_vertices(const OneWay& way, std::span<LeafPair> pairs, bool own_is_a) {
    SolidBodyScratch& scratch = way.solids.bodies[way.own];
    const BodyModel& body = way.model.bodies[way.own];
    const double reach = reach_of(way);
    way.solids.nearest.reset();
    for (LeafPair& pair : pairs)
        for (const Index triangle : body.covering.tree.items_of(own_is_a ? pair.leaf_a : pair.leaf_b))
            for (const Index v : body.surface.triangles[triangle]) {
                if (scratch.vertex_seen[v] != kNotSeen) continue;
                const Look look = test_vertex(way, v, reach);
                scratch.vertex_seen[v] = look.seen;
                pair.gap = std::min(pair.gap, look.gap);
            }
}

/// What was in is looked at whatever the descent found.
void probe_entries(const OneWay& way) {
    SolidBodyScratch& scratch = way.solids.bodies[way.own];
    const double reach = reach_of(way);
    way.solids.nearest.reset();
    const SolidEntry from{way.own, way.other};
    const std::vector<SolidEntry>& before = way.solids.entries_before;
    for (auto entry = std::lower_bound(before.begin(), before.end(), from, kByKey);
         entry != before.end() && entry->own == way.own && entry->other == way.other; ++entry)
        if (scratch.vertex_seen[entry->vertex] == kNotSeen)
            scratch.vertex_seen[entry->vertex] = test_vertex(way, entry->vertex, reach).seen;
}

/// All vertices whose path comes near the other body. False: there were more than may be looked at.
bool probe_paths(const OneWay& way, std::size_t& probes_left, SurfaceAccount& account) {
    SolidBodyScratch& scratch = way.solids.bodies[way.own];
    const SurfaceTravel& motion = way.solids.bodies[way.other].motion;
    const double reach = reach_of(way);
    way.solids.nearest.reset();
    Box3 bounds = way.solids.bodies[way.other].inside.tree().bounds();
    bounds.inflate(way.model.contact.margin + motion.spread);
    for (Index v = 0; v < scratch.vertex_seen.size(); ++v) {
        if (scratch.vertex_seen[v] != kNotSeen) continue;
        Box3 path;
        path.add(way.surface_t0(way.own)[v] + motion.mean);
        path.add(way.surface(way.own)[v]);
        if (!path.overlaps(bounds)) continue;
        if (probes_left == 0 || !account.take(kUnitsPerQuery)) return false;
        --probes_left;
        ++way.report.probe_tests;
        scratch.vertex_seen[v] = test_vertex(way, v, reach).seen;
    }
    return true;
}

/// [0, 1] where the segment from p to q passes through the triangle; negative: it does not.
double pierce(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& t) {
    const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
    const double from = normal.dot(p - t[0]), to = normal.dot(q - t[0]);
    if (!((from > 0.0) != (to > 0.0))) return -1.0;
    const double s = from / (from - to);
    const Vec3 x = p + s * (q - p);
    for (std::size_t k = 0; k < 3; ++k)
        if (normal.dot((t[(k + 1) % 3] - t[k]).cross(x - t[k])) < 0.0) return -1.0;
    return s;
}

/// Faces of the other body that come near those beneath a sphere, but for those of which a corner lies inside: it pushes already.
void list_near_faces(const OneWay& way, Index sphere, std::vector<NearFace>& out) {
    const BodyModel &own = way.model.bodies[way.own], &other = way.model.bodies[way.other];
    const std::vector<Vec3>&at = way.surface(way.own), &faces = way.surface(way.other);
    const std::vector<std::uint8_t>& seen = way.solids.bodies[way.other].vertex_seen;
    Box3 beneath;
    for (const Index triangle : own.covering.tree.items_of(sphere))
        for (const Index v : own.surface.triangles[triangle]) beneath.add(at[v]);
    out.clear();
    way.solids.bodies[way.other].inside.tree().for_each_overlapping(beneath, [&](Index face) {
        const Triangle& f = other.surface.triangles[face];
        if (seen[f[0]] == kInside || seen[f[1]] == kInside || seen[f[2]] == kInside) return;
        NearFace& near = out.emplace_back();
        near.face = face;
        for (const Index v : f) near.box.add(faces[v]);
    });
}

/// Where edges beneath a sphere pass through the other surface, unless an end of theirs lies inside and pushes already. False: nowhere.
bool list_piercings(const OneWay& way, Index sphere, std::vector<Piercing>& out) {
    std::vector<NearFace>& near_faces = way.solids.near_faces;
    list_near_faces(way, sphere, near_faces);
    if (near_faces.empty()) return false;
    Box3 around;
    for (const NearFace& near : near_faces) around.add(near.box);
    const std::size_t before = out.size();
    const BodyModel &own = way.model.bodies[way.own], &other = way.model.bodies[way.other];
    const std::vector<Vec3>&at = way.surface(way.own), &faces = way.surface(way.other);
    const std::vector<std::uint8_t>& seen = way.solids.bodies[way.own].vertex_seen;
    const std::vector<Index>& leaf_of = way.solids.bodies[way.own].leaf_of_triangle;
    for (const Index triangle : own.covering.tree.items_of(sphere))
        for (std::size_t k = 0; k < 3; ++k) {
            const Index edge = own.topology.triangle_edges[triangle][k];
            if (edge == kNoIndex) continue; // a corner that stands twice
            const Index owner = own.topology.edge_owner[edge];
            if (owner != triangle && leaf_of[owner] == sphere) continue; // beneath this sphere, too: it was its turn there
            const Triangle& t = own.surface.triangles[triangle];
            const Index v0 = std::min(t[k], t[(k + 1) % 3]), v1 = std::max(t[k], t[(k + 1) % 3]);
            if (seen[v0] == kInside || seen[v1] == kInside) continue;
            Box3 box;
            box.add(at[v0]);
            box.add(at[v1]);
            if (!around.overlaps(box)) continue;
            for (const NearFace& near : near_faces) {
                if (!near.box.overlaps(box)) continue;
                const Triangle& f = other.surface.triangles[near.face];
                if (const double s = pierce(at[v0], at[v1], {faces[f[0]], faces[f[1]], faces[f[2]]}); s >= 0.0) out.push_back({v0, v1, s, near.face});
            }
        }
    return out.size() > before;
}

/// Bits of sphere_seen.
constexpr std::uint8_t kGranted = 1, kEdgesSeen = 2;

/// Of all spheres of one body in the pairs, each once; the pair in which one comes first keeps the place.
void list_all_piercings(const OneWay& way, std::span<LeafPair> pairs, bool own_is_a, std::vector<Piercing>& out) {
    std::vector<std::uint8_t>& seen = way.solids.bodies[way.own].sphere_seen;
    for (LeafPair& pair : pairs) {
        const Index sphere = own_is_a ? pair.leaf_a : pair.leaf_b;
        if ((seen[sphere] & kEdgesSeen) != 0) continue;
        seen[sphere] |= kEdgesSeen;
        if (list_piercings(way, sphere, out)) pair.gap = std::min(pair.gap, 0.0);
    }
}

/// The edge of a surface between two of its faces; kNoIndex: they have none in common.
Index find_edge_between(const collision::SurfaceTopology& topology, Index face_a, Index face_b) {
    for (const Index edge : topology.triangle_edges[face_a])
        for (const Index there : topology.triangle_edges[face_b])
            if (edge != kNoIndex && edge == there) return edge;
    return kNoIndex;
}

/// An edge goes in by one face and out by the next one, round a sharp edge of the other body: the two cross there. Seen before as a pair of
/// edges, it is listed already. False: the middle of what lies inside has to do.
bool touch_where_edges_cross(const OneWay& way, std::size_t first_touch, const Piercing& in, const Piercing& out) {
    if (way.solids.bodies[way.other].sharp.count == 0) return false;
    if (cross_there(way.solids, first_touch, way.own, in, out)) return true;
    const Index theirs = find_edge_between(way.model.bodies[way.other].topology, in.face, out.face);
    if (!way.solids.bodies[way.other].sharp.has(theirs)) return false;
    const Index mine = collision::find_edge(way.model.bodies[way.own].topology, in.v0, in.v1);
    const bool turned = way.own > way.other; // an edge of the lower body comes first
    const OneWay ordered{way.model, way.state, way.solids, way.report, std::min(way.own, way.other), std::max(way.own, way.other), way.entries};
    const Index a = turned ? theirs : mine, b = turned ? mine : theirs;
    const auto found = place_edges(ordered, a, b);
    if (!found || found->gap > 0.0) return false;
    if (is_listed(ordered, first_touch, a, b)) return true;
    way.solids.touches.push_back(make_edge_touch(ordered, a, b, *found));
    return true;
}

/// Edges that go through the other body with both ends outside: the middle of what lies inside.
void probe_edges(const OneWay& way, std::size_t first_touch, std::vector<Piercing>& piercings) {
    std::sort(piercings.begin(), piercings.end(),
              [](const Piercing& x, const Piercing& y) { return std::tie(x.v0, x.v1, x.s, x.face) < std::tie(y.v0, y.v1, y.s, y.face); });
    for (std::size_t k = 1; k < piercings.size(); ++k) {
        const Piercing &in = piercings[k - 1], &out = piercings[k];
        if (in.v0 != out.v0 || in.v1 != out.v1 || !(out.s > in.s)) continue;
        if (touch_where_edges_cross(way, first_touch, in, out)) continue;
        const double middle = 0.5 * (in.s + out.s);
        const VertexProbe probe{{in.v0, in.v1}, {1.0 - middle, middle}};
        add_edge_touch(way, probe);
    }
}

/// What is drawn back through a body meets the far side of it from behind: a touch that pushes the other way, among the places from
/// `first_pressed` on and their ways out, would hold it where it is. All touches from `first_touch` on are those of vertices and edges of two
/// bodies; the entries of the vertices that are dropped, from `first_entry` on, go with them.
void drop_opposing(std::size_t first_touch, std::size_t first_entry, std::size_t first_pressed, State& state, SolidScratch& solids) {
    std::vector<SolidEntry>& listed = state.solids.entries;
    if (first_pressed == solids.pressed.size()) return;
    const Thing a = solids.touches[first_touch].a;
    const auto direction_of = [a](const Contact& touch) { return touch.a == a ? touch.normal : Vec3(-touch.normal); };
    Vec3 back = Vec3::Zero();
    Box3 among;
    for (std::size_t k = first_pressed; k < solids.pressed.size(); ++k) {
        const Contact& touch = solids.touches[solids.pressed[k]];
        back += direction_of(touch);
        if (touch.between_edges()) { // all that the two wedges have in common
            Box3 wedges;
            wedges.add(touch.point);
            wedges.add(touch.point + touch.gap * touch.normal);
            wedges.inflate(-touch.gap);
            among.add(wedges);
            continue;
        }
        among.add(touch.point);
        among.add(state.bodies[touch.a.index()].surface[touch.feature_a[0]]);
    }
    std::size_t touches = first_touch, pressed = first_pressed;
    for (std::size_t k = first_touch; k < solids.touches.size(); ++k) {
        const Contact& touch = solids.touches[k];
        const bool is_pressed = pressed < solids.pressed.size() && solids.pressed[pressed] == k;
        if (!is_pressed && direction_of(touch).dot(back) < 0.0 && among.contains(touch.point)) {
            if (touch.feature_a[1] != kNoIndex) continue; // of an edge
            const auto key = SolidEntry{touch.a.index(), touch.b.index(), touch.feature_a[0]}.key();
            const auto from = listed.begin() + static_cast<std::ptrdiff_t>(first_entry);
            listed.erase(std::remove_if(from, listed.end(), [&](const SolidEntry& entry) { return entry.key() == key; }), listed.end());
            continue;
        }
        if (is_pressed) solids.pressed[pressed++] = touches;
        solids.touches[touches++] = touch;
    }
    solids.touches.resize(touches);
}

/// Did the budget leave pairs of spheres of two bodies that come so far against each other in this step that what was looked at says nothing
/// of what has crossed meanwhile?
bool needs_all_paths(const SolidScratch& solids, std::size_t a, std::size_t b, double margin, bool leaves_left) {
    if (!(find_relative_way(solids.bodies[a].motion, solids.bodies[b].motion) > margin)) return false;
    const auto& open = solids.open_bodies;
    return leaves_left || std::binary_search(open.begin(), open.end(), std::pair{static_cast<Index>(a), static_cast<Index>(b)});
}

/// Units of what a sphere's leaf has beneath it; nothing a second time.
std::uint64_t leaf_units(const SceneModel& model, std::size_t body, Index leaf, const SolidScratch& solids) {
    if ((solids.bodies[body].sphere_seen[leaf] & kGranted) != 0) return 0;
    return kUnitsPerLeafTriangle * model.bodies[body].covering.tree.items_of(leaf).size();
}

/// The next leaf pairs that a grant has room for, by key. False: there is no room for one more.
/// all     those of line_up, by key
/// others  units of what is looked at with them
bool take_batch(const SceneModel& model, std::span<const LeafPair> all, std::size_t& next, std::uint64_t others, SolidScratch& solids,
                SurfaceAccount& account) {
    solids.batch.clear();
    account.settle();
    for (; next < solids.waiting.size(); ++next) {
        const LeafPair& pair = solids.waiting[next];
        const std::uint64_t units = leaf_units(model, pair.a, pair.leaf_a, solids) + leaf_units(model, pair.b, pair.leaf_b, solids) +
                                    edge_units(solids.bodies[pair.a].sharp, pair.leaf_a, solids.bodies[pair.b].sharp, pair.leaf_b);
        if (!(solids.batch.empty() ? account.take(units + others) : account.take_more(units))) break;
        solids.bodies[pair.a].sphere_seen[pair.leaf_a] |= kGranted;
        solids.bodies[pair.b].sphere_seen[pair.leaf_b] |= kGranted;
        solids.batch.push_back(pair);
    }
    if (solids.batch.size() == all.size())
        std::copy(all.begin(), all.end(), solids.batch.begin());
    else
        std::sort(solids.batch.begin(), solids.batch.end(), kByKey);
    return !solids.batch.empty();
}

/// Vertices of one body that were in the other one.
std::size_t count_entries(const SolidScratch& solids, std::size_t own, std::size_t other) {
    const std::vector<SolidEntry>& entries = solids.entries_before;
    const auto begin_of = [&](std::size_t there) { return std::lower_bound(entries.begin(), entries.end(), SolidEntry{own, there}, kByKey); };
    return static_cast<std::size_t>(begin_of(other + 1) - begin_of(other));
}

/// Fills solids.waiting: those that touched in the last step first, then the others, from one on that is drawn anew for each step, so that none of
/// them is left for good where there is no room for all. Both lists are by key.
void line_up(std::span<const LeafPair> pairs, std::uint64_t step, SolidScratch& solids) {
    solids.waiting.clear();
    if (pairs.empty()) return;
    std::size_t others = 0;
    const auto from = std::lower_bound(solids.touching_before.begin(), solids.touching_before.end(), pairs.front(), kByKey);
    for (const bool first : {true, false}) {
        auto before = from;
        for (const LeafPair& pair : pairs) {
            while (before != solids.touching_before.end() && before->key() < pair.key()) ++before;
            const bool touched = before != solids.touching_before.end() && before->key() == pair.key();
            if (touched == first) solids.waiting.push_back(pair);
        }
        if (first) others = solids.waiting.size();
    }
    if (others == solids.waiting.size()) return;
    constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15; // high bits of its multiples serve as a hash of the step
    const std::uint64_t start = (step * kGolden >> 32) % (solids.waiting.size() - others);
    const auto from_others = solids.waiting.begin() + static_cast<std::ptrdiff_t>(others);
    std::rotate(from_others, from_others + static_cast<std::ptrdiff_t>(start), solids.waiting.end());
}

/// Leaf pairs of two bodies, as far as the account goes: as many at a time as a grant holds.
void touch_bodies(const SceneModel& model, State& state, std::size_t a, std::size_t b, std::span<const LeafPair> pairs,
                  std::size_t& probes_left, SurfaceAccount& account, SolidScratch& solids, StepReport& report) {
    const OneWay from_a{model, state, solids, report, a, b, state.solids.entries};
    const OneWay from_b{model, state, solids, report, b, a, state.solids.entries};
    const std::size_t first_touch = solids.touches.size(), first_entry = state.solids.entries.size(), first_pressed = solids.pressed.size();
    std::vector<Piercing>&of_a = solids.piercings[0], &of_b = solids.piercings[1];
    of_a.clear(), of_b.clear();
    for (const std::size_t body : {a, b}) {
        solids.bodies[body].vertex_seen.assign(state.bodies[body].surface.size(), kNotSeen);
        solids.bodies[body].sphere_seen.assign(model.bodies[body].covering.tree.sphere_count(), 0);
    }
    const bool have_edges = solids.bodies[a].sharp.count > 0 && solids.bodies[b].sharp.count > 0;
    line_up(pairs, state.step, solids);
    const auto first_done = static_cast<std::ptrdiff_t>(solids.done_pairs.size());
    std::size_t next = 0;
    std::uint64_t others = kUnitsPerQuery * (count_entries(solids, a, b) + count_entries(solids, b, a));
    for (bool first = true; take_batch(model, pairs, next, others, solids, account) || first; first = false, others = 0) {
        probe_vertices(from_a, solids.batch, true);
        if (first) probe_entries(from_a);
        probe_vertices(from_b, solids.batch, false);
        if (first) probe_entries(from_b);
        list_all_piercings(from_a, solids.batch, true, of_a);
        list_all_piercings(from_b, solids.batch, false, of_b);
        if (first && have_edges) touch_edges_before(from_a, first_touch);
        for (LeafPair& pair : solids.batch) touch_edges(from_a, first_touch, pair);
        solids.done_pairs.insert(solids.done_pairs.end(), solids.batch.begin(), solids.batch.end());
    }
    account.settle();
    const auto done = solids.done_pairs.begin() + first_done; // in batches, each by key
    if (!std::is_sorted(done, solids.done_pairs.end(), kByKey)) std::sort(done, solids.done_pairs.end(), kByKey);
    if (next < solids.waiting.size())
        std::set_difference(pairs.begin(), pairs.end(), done, solids.done_pairs.end(), std::back_inserter(solids.left_pairs), kByKey);
    if (needs_all_paths(solids, a, b, model.contact.margin, next < solids.waiting.size())) {
        const bool all_of_a = probe_paths(from_a, probes_left, account), all_of_b = probe_paths(from_b, probes_left, account);
        report.unproven_solids += !(all_of_a && all_of_b) || have_edges; // paths of vertices, and of no edge
    }
    probe_edges(from_a, first_touch, of_a);
    probe_edges(from_b, first_touch, of_b);
    drop_opposing(first_touch, first_entry, first_pressed, state, solids);
}

/// The same of a body with itself, all of them or none.
void touch_own(const SceneModel& model, const State& state, std::size_t body, std::span<const LeafPair> pairs, SurfaceAccount& account,
               SolidScratch& solids, StepReport& report) {
    solids.batch.assign(pairs.begin(), pairs.end());
    solids.bodies[body].sphere_seen.assign(model.bodies[body].covering.tree.sphere_count(), 0);
    std::uint64_t units = 0;
    for (const LeafPair& pair : pairs)
        for (const Index leaf : {pair.leaf_a, pair.leaf_b}) {
            units += leaf_units(model, body, leaf, solids);
            solids.bodies[body].sphere_seen[leaf] |= kGranted;
        }
    if (!account.take(units)) {
        solids.left_pairs.insert(solids.left_pairs.end(), pairs.begin(), pairs.end());
        return;
    }
    touch_self(model, state, solids.batch, solids, report);
    account.settle();
    solids.done_pairs.insert(solids.done_pairs.end(), solids.batch.begin(), solids.batch.end());
}

/// Two edges that crossed in the last step: has this one looked at them?
bool is_seen(const OneWay& way, const Contact& touch) {
    const Index e = collision::find_edge(way.model.bodies[way.own].topology, touch.feature_a[0], touch.feature_a[1]);
    const Index f = collision::find_edge(way.model.bodies[way.other].topology, touch.feature_b[0], touch.feature_b[1]);
    const SolidBodyScratch &own = way.solids.bodies[way.own], &other = way.solids.bodies[way.other];
    if (e == kNoIndex || f == kNoIndex || is_listed(way, 0, e, f)) return true;
    const bool sharp = own.sharp.has(e) && other.sharp.has(f);
    if (sharp && is_touching(touch)) return true; // touch_edges_before
    const auto granted = [&](std::size_t body, const SolidBodyScratch& scratch, Index edge) {
        return (scratch.sphere_seen[scratch.leaf_of_triangle[way.model.bodies[body].topology.edge_owner[edge]]] & kGranted) != 0;
    };
    const bool seen[2] = {granted(way.own, own, e), granted(way.other, other, f)};
    return sharp ? seen[0] && seen[1] : seen[0] || seen[1];
}

/// solids.leaf_pairs by key, in time that grows with their number alone: by the second leaf, by the first, by the two bodies.
void sort_pairs(const SceneModel& model, SolidScratch& solids) {
    std::vector<LeafPair>& pairs = solids.leaf_pairs;
    if (std::is_sorted(pairs.begin(), pairs.end(), kByKey)) return;
    const auto place_of = [&](const LeafPair& pair) {
        const std::pair bodies{static_cast<Index>(pair.a), static_cast<Index>(pair.b)};
        return static_cast<std::size_t>(std::lower_bound(solids.meeting.begin(), solids.meeting.end(), bodies) - solids.meeting.begin());
    };
    std::size_t spheres = 0;
    for (const auto& [a, b] : solids.meeting)
        spheres = std::max({spheres, model.bodies[a].covering.tree.sphere_count(), model.bodies[b].covering.tree.sphere_count()});
    const auto sort_by = [&](auto&& key, std::size_t keys) {
        solids.begin_of.assign(keys + 1, 0);
        for (const LeafPair& pair : pairs) ++solids.begin_of[key(pair) + 1];
        for (std::size_t k = 0; k < keys; ++k) solids.begin_of[k + 1] += solids.begin_of[k];
        solids.batch.resize(pairs.size());
        for (const LeafPair& pair : pairs) solids.batch[solids.begin_of[key(pair)]++] = pair;
        std::swap(pairs, solids.batch);
    };
    sort_by([](const LeafPair& pair) { return std::size_t{pair.leaf_b}; }, spheres);
    sort_by([](const LeafPair& pair) { return std::size_t{pair.leaf_a}; }, spheres);
    if (solids.meeting.size() > 1) sort_by(place_of, solids.meeting.size());
}

/// What pressed between two bodies, where this step did not look: it goes on, and what was in stays in.
/// looked   some of their leaves were, and vertex_seen tells which vertices
void carry_touches(const SceneModel& model, State& state, std::size_t a, std::size_t b, bool looked, SolidScratch& solids, StepReport& report) {
    const auto is_between = [&](std::size_t x, std::size_t y) { return (x == a && y == b) || (x == b && y == a); };
    const auto carry = [&](const Contact& touch) {
        if (touch.origin != ContactOrigin::Proximity) return;
        const OneWay way{model, state, solids, report, touch.a.index(), touch.b.index(), state.solids.entries};
        if (looked && (touch.between_edges() ? is_seen(way, touch) : solids.bodies[touch.a.index()].vertex_seen[touch.feature_a[0]] != kNotSeen)) return;
        const std::optional<Contact> now = carry_touch(way, touch);
        if (!now) return;
        solids.touches.push_back(*now);
        ++report.carried_places;
    };
    using Things = std::pair<Thing, Thing>;
    const auto before = [](const SolidContact& place, const Things& things) { return Things(place.touch.a, place.touch.b) < things; };
    const std::vector<SolidContact>& places = solids.contacts_before; // by key, which begins with the two
    const auto carry_all = [&](const Things& things) {
        for (auto place = std::lower_bound(places.begin(), places.end(), things, before);
             place != places.end() && Things(place->touch.a, place->touch.b) == things; ++place)
            carry(place->touch);
    };
    carry_all({Thing::body(a), Thing::body(b)});
    if (a != b) carry_all({Thing::body(b), Thing::body(a)});
    if (looked) return; // entries are looked at whatever there is room for
    for (const SolidEntry& entry : solids.entries_before)
        if (is_between(entry.own, entry.other)) state.solids.entries.push_back(entry);
}

} // namespace

void find_touches(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report, StepBudget& budget) {
    SurfaceAccount account(budget);
    std::vector<LeafPair>& pairs = solids.leaf_pairs;
    solids.touches.clear();
    solids.pressed.clear();
    std::swap(state.solids.entries, solids.entries_before);
    state.solids.entries.clear();
    std::swap(state.solids.touching, solids.touching_before);
    pairs.clear();
    choose_looked(model, state, solids, account);
    for (const Contact& contact : solids.coarse) {
        if (!is_between_bodies(contact)) continue;
        if (!meet_by_surface(model, contact.a.index(), contact.b.index()) || !is_leaf_pair(model, contact)) continue;
        if (is_looked(solids, contact.a.index(), contact.b.index()))
            pairs.push_back({contact.a.index(), contact.b.index(), contact.feature_a[0], contact.feature_b[0]});
        else
            ++report.left_pairs;
    }
    probe_open_pairs(model, solids, report, account);
    sort_pairs(model, solids);
    pairs.erase(std::unique(pairs.begin(), pairs.end(), [](const LeafPair& x, const LeafPair& y) { return x.key() == y.key(); }),
                pairs.end());
    std::sort(solids.left_bodies.begin(), solids.left_bodies.end());
    const auto probed_in_part = solids.left_bodies.size(); // and those that were not looked at
    solids.done_pairs.clear();
    solids.left_pairs.clear();
    std::size_t begin = 0, probes_left = kPathProbes;
    for (std::size_t m = 0; m < solids.meeting.size(); ++m) {
        const auto [a, b] = solids.meeting[m];
        std::size_t end = begin;
        while (end < pairs.size() && pairs[end].a == a && pairs[end].b == b) ++end;
        const std::span<const LeafPair> of_these = std::span(pairs).subspan(begin, end - begin);
        begin = end;
        const std::size_t left_before = solids.left_pairs.size();
        const bool looked = solids.looked[m] != 0;
        if (looked && a != b)
            touch_bodies(model, state, a, b, of_these, probes_left, account, solids, report);
        else if (looked && !of_these.empty())
            touch_own(model, state, a, of_these, account, solids, report);
        const bool is_left = solids.left_pairs.size() > left_before;
        report.left_pairs += !looked;
        if (is_left) solids.left_bodies.push_back(solids.meeting[m]);
        const std::span<const std::pair<Index, Index>> others = std::span(solids.left_bodies).first(probed_in_part);
        if (is_left || std::binary_search(others.begin(), others.end(), solids.meeting[m]))
            carry_touches(model, state, a, b, looked && a != b, solids, report);
    }
}

} // namespace trocar::engine
