#include "engine/prepare/thing.hpp"
#include "engine/step/solid/solid_touch.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/self_touch.hpp"
#include "engine/step/solid/solid_passage.hpp"
#include "engine/step/solid/solid_probe.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/tissue/surface_place.hpp"
#include "engine/step/solid/surface_travel.hpp"
#include "engine/step/solid/touch_rules.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace trocar::engine {

namespace {

/// Vertices in a step that are looked at because their bodies moved far and the budget left sphere pairs open. A thousand cost about a
/// millisecond; with more, what was not looked at is reported (unproven_solids).
constexpr std::size_t kPathProbes = 4096;

constexpr auto by_key = [](const auto& x, const auto& y) { return x.key() < y.key(); };

/// A place of a surface: a vertex, or a point of an edge.
struct VertexProbe {
    Index vertex[2] = {kNoIndex, kNoIndex};
    double weight[2] = {1.0, 0.0};

    [[nodiscard]] Vec3 at(const std::vector<Vec3>& surface) const {
        return vertex[1] == kNoIndex ? surface[vertex[0]] : Vec3(weight[0] * surface[vertex[0]] + weight[1] * surface[vertex[1]]);
    }
};

void find_vertex_normals(const TriMesh& mesh, const std::vector<Vec3>& surface, std::vector<Vec3>& normals) {
    normals.assign(surface.size(), Vec3::Zero());
    for (const Triangle& t : mesh.triangles) {
        const Vec3 area = twice_area(t, surface);
        for (const Index v : t) normals[v] += area;
    }
    for (Vec3& n : normals) n = spheretree::direction_of(n);
}

Vec3 face_normal(const std::vector<Vec3>& surface, const Triangle& t) { return spheretree::direction_of(twice_area(t, surface)); }

/// What add_touch saw; vertex_seen holds it once a vertex was looked at.
enum Seen : std::uint8_t { kNotSeen = 0, kFar, kNear, kInside };

struct Look {
    Seen seen = kFar;
    double gap = std::numeric_limits<double>::infinity(); // m, of the touch that was listed
};

/// The touch of a place with what of the other surface it stands before, or behind.
Contact make_touch(const OneWay& way, const VertexProbe& probe, const Vec3& place, const SurfacePoint& at, bool inside) {
    const Triangle& face = way.face(at.triangle);
    Contact touch;
    touch.body_a = static_cast<BodyId>(way.own);
    touch.body_b = static_cast<BodyId>(way.other);
    touch.origin = ContactOrigin::Proximity;
    touch.point = at.point;
    touch.gap = inside ? -at.distance : at.distance;
    const Vec3 out = inside ? Vec3(at.point - place) : Vec3(place - at.point);
    touch.normal = at.distance > kNoWay ? Vec3(out / at.distance) : face_normal(way.surface(way.other), face);
    for (int k = 0; k < 2; ++k) touch.feature_a[k] = probe.vertex[k], touch.bary_a[k] = probe.weight[k];
    for (std::size_t k = 0; k < 3; ++k) touch.feature_b[k] = face[k], touch.bary_b[k] = at.bary[k];
    return touch;
}

/// Gives the touch the normal by which the two surfaces push there. False: they do not.
bool turn_touch(const OneWay& way, const NormalCone& own, const SurfacePoint& at, const Vec3& place, Contact& touch) {
    const double facet = facet_cosine(way.solids.bodies[way.other].adjacency, way.model.bodies[way.other].topology, at.triangle,
                                      way.surface(way.other));
    const std::optional<Vec3> normal = choose_normal(own, touch.normal, facet);
    if (!normal) return false;
    if (*normal == touch.normal) return true;
    touch.normal = *normal;
    touch.gap = normal->dot(place - at.point);
    return true;
}

NormalCone cone_at(const OneWay& way, Index v) {
    return cone_of_vertex(way.solids.bodies[way.own].adjacency, way.model.bodies[way.own].surface.triangles, v, way.surface(way.own));
}

/// reach: m, how far the other surface comes, and the margin
Look test_vertex(const OneWay& way, Index v, double reach) {
    const Vec3 place = way.surface(way.own)[v];
    const double own_way = (place - way.surface_t0(way.own)[v] - way.shared()).norm();
    const auto standing = find_standing(way, v, reach + own_way);
    if (!standing) return {};
    Contact touch = make_touch(way, {{v, kNoIndex}, {1.0, 0.0}}, place, standing->at, standing->inside);
    SolidScratch& solids = way.solids;
    const bool meets = standing->pressed || turn_touch(way, cone_at(way, v), standing->at, place, touch);
    if (!standing->inside) {
        const Triangle& face = way.face(standing->at.triangle);
        const Vec3 now = point_on(face, standing->at.bary, way.surface(way.other));
        const Vec3 before = point_on(face, standing->at.bary, way.surface_t0(way.other));
        if (touch.gap > way.model.contact.margin + own_way + (now - before - way.shared()).norm() + way.known_change()) return {};
        if (!meets || touch.normal.dot(way.solids.bodies[way.own].vertex_normal[v]) > kFacing) return {};
    } else {
        if (standing->pressed) solids.pressed.push_back(solids.touches.size());
        way.report.passed_places += standing->passed;
        way.entries.push_back({way.own, way.other, v, standing->by, standing->at.distance});
    }
    if (meets) solids.touches.push_back(touch);
    return {standing->inside ? kInside : kNear, touch.gap};
}

/// The middle of what lies inside of an edge.
void add_edge_touch(const OneWay& way, const VertexProbe& probe) {
    const InsideTest& against = way.solids.bodies[way.other].inside;
    const Vec3 place = probe.at(way.surface(way.own));
    if (!against.inside(place)) return;
    const auto hit = against.tree().closest(place);
    if (!hit) return;
    Contact touch = make_touch(way, probe, place, *hit, true);
    const BodyModel& own = way.model.bodies[way.own];
    const NormalCone cone = cone_of_edge(way.solids.bodies[way.own].adjacency, own.topology, probe.vertex[0], probe.vertex[1], way.surface(way.own));
    if (turn_touch(way, cone, *hit, place, touch)) way.solids.touches.push_back(touch);
}

double reach_of(const OneWay& way) {
    const SurfaceTravel& motion = way.solids.bodies[way.other].motion;
    const double farthest = std::min((motion.mean - way.shared()).norm() + motion.spread, motion.farthest + way.shared().norm());
    return way.model.contact.margin + farthest + way.known_change();
}

void probe_vertices(const OneWay& way, std::span<LeafPair> pairs, bool own_is_a) {
    SolidBodyScratch& scratch = way.solids.bodies[way.own];
    const BodyModel& body = way.model.bodies[way.own];
    scratch.vertex_seen.assign(way.surface(way.own).size(), kNotSeen);
    const double reach = reach_of(way);
    for (LeafPair& pair : pairs)
        for (const Index triangle : body.covering.tree.items_of(own_is_a ? pair.leaf_a : pair.leaf_b))
            for (const Index v : body.surface.triangles[triangle]) {
                if (scratch.vertex_seen[v] != kNotSeen) continue;
                const Look look = test_vertex(way, v, reach);
                scratch.vertex_seen[v] = look.seen;
                pair.gap = std::min(pair.gap, look.gap);
            }
    const SolidEntry from{way.own, way.other}; // what was in is looked at whatever the descent found
    const std::vector<SolidEntry>& before = way.solids.entries_before;
    for (auto entry = std::lower_bound(before.begin(), before.end(), from, by_key);
         entry != before.end() && entry->own == way.own && entry->other == way.other; ++entry)
        if (scratch.vertex_seen[entry->vertex] == kNotSeen)
            scratch.vertex_seen[entry->vertex] = test_vertex(way, entry->vertex, reach).seen;
}

/// All vertices whose path comes near the other body. False: there were more than may be looked at.
bool probe_paths(const OneWay& way, std::size_t& probes_left) {
    SolidBodyScratch& scratch = way.solids.bodies[way.own];
    const SurfaceTravel& motion = way.solids.bodies[way.other].motion;
    const double reach = reach_of(way);
    Box3 bounds = way.solids.bodies[way.other].inside.tree().bounds();
    bounds.inflate(way.model.contact.margin + motion.spread);
    for (Index v = 0; v < scratch.vertex_seen.size(); ++v) {
        if (scratch.vertex_seen[v] != kNotSeen) continue;
        Box3 path;
        path.add(way.surface_t0(way.own)[v] + motion.mean);
        path.add(way.surface(way.own)[v]);
        if (!path.overlaps(bounds)) continue;
        if (probes_left == 0) return false;
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

/// Where edges beneath a sphere pass through the other surface, unless an end of theirs or a corner there lies inside and pushes
/// already. False: nowhere.
bool list_piercings(const OneWay& way, Index sphere, std::vector<Piercing>& out) {
    const std::size_t before = out.size();
    const BodyModel &own = way.model.bodies[way.own], &other = way.model.bodies[way.other];
    const std::vector<Vec3>&at = way.surface(way.own), &faces = way.surface(way.other);
    const std::vector<std::uint8_t>&seen = way.solids.bodies[way.own].vertex_seen, &seen_there = way.solids.bodies[way.other].vertex_seen;
    for (const Index triangle : own.covering.tree.items_of(sphere))
        for (std::size_t k = 0; k < 3; ++k) {
            const Triangle& t = own.surface.triangles[triangle];
            const Index v0 = std::min(t[k], t[(k + 1) % 3]), v1 = std::max(t[k], t[(k + 1) % 3]);
            if (seen[v0] == kInside || seen[v1] == kInside) continue;
            Box3 box;
            box.add(at[v0]);
            box.add(at[v1]);
            way.solids.bodies[way.other].inside.tree().for_each_overlapping(box, [&](Index face) {
                const Triangle& f = other.surface.triangles[face];
                if (seen_there[f[0]] == kInside || seen_there[f[1]] == kInside || seen_there[f[2]] == kInside) return;
                if (const double s = pierce(at[v0], at[v1], {faces[f[0]], faces[f[1]], faces[f[2]]}); s >= 0.0) out.push_back({v0, v1, s});
            });
        }
    return out.size() > before;
}

/// Of all spheres of one body in the pairs, each once; the pair in which one comes first keeps the place.
void list_all_piercings(const OneWay& way, std::span<LeafPair> pairs, bool own_is_a, std::vector<Piercing>& out) {
    std::vector<std::uint8_t>& seen = way.solids.bodies[way.own].sphere_seen;
    seen.assign(way.model.bodies[way.own].covering.tree.sphere_count(), 0);
    out.clear();
    for (LeafPair& pair : pairs) {
        const Index sphere = own_is_a ? pair.leaf_a : pair.leaf_b;
        if (seen[sphere] != 0) continue;
        seen[sphere] = 1;
        if (list_piercings(way, sphere, out)) pair.gap = std::min(pair.gap, 0.0);
    }
}

/// Edges that go through the other body with both ends outside: the middle of what lies inside.
void probe_edges(const OneWay& way, std::vector<Piercing>& piercings) {
    std::sort(piercings.begin(), piercings.end(),
              [](const Piercing& x, const Piercing& y) { return std::tie(x.v0, x.v1, x.s) < std::tie(y.v0, y.v1, y.s); });
    for (std::size_t k = 1; k < piercings.size(); ++k) {
        const Piercing &in = piercings[k - 1], &out = piercings[k];
        if (in.v0 != out.v0 || in.v1 != out.v1 || !(out.s > in.s)) continue;
        const double middle = 0.5 * (in.s + out.s);
        const VertexProbe probe{{in.v0, in.v1}, {1.0 - middle, middle}};
        add_edge_touch(way, probe);
    }
}

/// Depths and vertex normals of this step, once for all bodies that one meets.
void refresh(const SceneModel& model, const State& state, std::size_t body, SolidScratch& solids) {
    SolidBodyScratch& scratch = solids.bodies[body];
    if (scratch.surface_is_fresh) return;
    scratch.surface_is_fresh = true;
    if (model.bodies[body].moves()) {
        scratch.inside.refit(state.bodies[body].surface);
        scratch.motion = find_motion(scratch.surface_t0, state.bodies[body].surface);
    }
    if (model.bodies[body].moves() || scratch.vertex_normal.empty())
        find_vertex_normals(model.bodies[body].surface, state.bodies[body].surface, scratch.vertex_normal);
}

/// What is drawn back through a body meets the far side of it from behind: a touch that pushes the other way, among the places from
/// `first_pressed` on and their ways out, would hold it where it is. All touches from `first_touch` on are those of vertices of two
/// bodies; the entries of what is dropped, from `first_entry` on, go with it.
void drop_opposing(std::size_t first_touch, std::size_t first_entry, std::size_t first_pressed, State& state, SolidScratch& solids) {
    std::vector<SolidEntry>& listed = state.solids.entries;
    if (first_pressed == solids.pressed.size()) return;
    const std::size_t a = solids.touches[first_touch].body_a;
    const auto direction_of = [a](const Contact& touch) { return touch.body_a == a ? touch.normal : Vec3(-touch.normal); };
    Vec3 back = Vec3::Zero();
    Box3 among;
    for (std::size_t k = first_pressed; k < solids.pressed.size(); ++k) {
        const Contact& touch = solids.touches[solids.pressed[k]];
        back += direction_of(touch);
        among.add(touch.point);
        among.add(state.bodies[touch.body_a].surface[touch.feature_a[0]]);
    }
    std::size_t touches = first_touch, pressed = first_pressed;
    for (std::size_t k = first_touch; k < solids.touches.size(); ++k) {
        const Contact& touch = solids.touches[k];
        const bool is_pressed = pressed < solids.pressed.size() && solids.pressed[pressed] == k;
        if (!is_pressed && direction_of(touch).dot(back) < 0.0 && among.contains(touch.point)) {
            const auto key = SolidEntry{touch.body_a, touch.body_b, touch.feature_a[0]}.key();
            const auto from = listed.begin() + static_cast<std::ptrdiff_t>(first_entry);
            listed.erase(std::remove_if(from, listed.end(), [&](const SolidEntry& entry) { return entry.key() == key; }), listed.end());
            continue;
        }
        if (is_pressed) solids.pressed[pressed++] = touches;
        solids.touches[touches++] = touch;
    }
    solids.touches.resize(touches);
}

/// Did the budget leave sphere pairs of two bodies open that come so far against each other in this step that the few places which a
/// look at the open pairs gives (solid_probe.hpp) say nothing of what has crossed meanwhile?
bool needs_all_paths(const SceneModel& model, const SolidScratch& solids, std::size_t a, std::size_t b) {
    if (!(find_relative_way(solids.bodies[a].motion, solids.bodies[b].motion) > model.contact.margin)) return false;
    const auto& open = solids.open_bodies;
    return std::binary_search(open.begin(), open.end(), std::pair{static_cast<Index>(a), static_cast<Index>(b)});
}

void touch_bodies(const SceneModel& model, State& state, std::size_t a, std::size_t b, std::span<LeafPair> pairs,
                  std::size_t& probes_left, SolidScratch& solids, StepReport& report) {
    const OneWay from_a{model, state, solids, report, a, b, state.solids.entries};
    const OneWay from_b{model, state, solids, report, b, a, state.solids.entries};
    const std::size_t first_touch = solids.touches.size(), first_entry = state.solids.entries.size(), first_pressed = solids.pressed.size();
    probe_vertices(from_a, pairs, true);
    probe_vertices(from_b, pairs, false);
    if (needs_all_paths(model, solids, a, b)) {
        const bool all_of_a = probe_paths(from_a, probes_left), all_of_b = probe_paths(from_b, probes_left);
        report.unproven_solids += !(all_of_a && all_of_b);
    }
    drop_opposing(first_touch, first_entry, first_pressed, state, solids);
    std::vector<Piercing>&of_a = solids.piercings[0], &of_b = solids.piercings[1];
    list_all_piercings(from_a, pairs, true, of_a);
    list_all_piercings(from_b, pairs, false, of_b);
    probe_edges(from_a, of_a);
    probe_edges(from_b, of_b);
}

/// Bodies whose surfaces are looked at in this step, each two once; what is asked of them is made fresh.
void list_touching_pairs(const SceneModel& model, const State& state, SolidScratch& solids) {
    std::vector<std::pair<Index, Index>>& meeting = solids.meeting;
    meeting.clear();
    const auto add = [&](std::size_t a, std::size_t b) {
        const std::pair<Index, Index> bodies{static_cast<Index>(std::min(a, b)), static_cast<Index>(std::max(a, b))};
        if (meeting.empty() || meeting.back() != bodies) meeting.push_back(bodies);
    };
    for (const Contact& contact : solids.coarse)
        if (is_between_bodies(model, contact) &&
            meet_by_surface(model, contact.body_a, contact.body_b))
            add(contact.body_a, contact.body_b);
    for (const SolidEntry& entry : solids.entries_before) add(entry.own, entry.other);
    for (const LeafPair& pair : state.solids.touching) // looked at again whatever the descent says
        if (pair.a == pair.b) add(pair.a, pair.b);
    std::sort(meeting.begin(), meeting.end());
    meeting.erase(std::unique(meeting.begin(), meeting.end()), meeting.end());
    for (const auto& [a, b] : meeting) {
        refresh(model, state, a, solids);
        refresh(model, state, b, solids);
    }
}

/// Bodies whose spheres meet, but whose surfaces nobody looks at, or that have no inside: what goes farther than half of the thinner one
/// in a step may be on its other side.
void count_unproven(const SceneModel& model, const State& state, const SolidScratch& solids, StepReport& report) {
    std::pair<BodyId, BodyId> last{0, 0};
    for (const Contact& contact : solids.coarse) {
        const std::pair<BodyId, BodyId> bodies{contact.body_a, contact.body_b};
        if (bodies == last || bodies.first == bodies.second) continue; // a pair's contacts lie side by side
        if (!is_between_bodies(model, contact)) continue;
        last = bodies;
        if (meet_by_surface(model, bodies.first, bodies.second)) continue;
        SurfaceTravel motion[2];
        for (std::size_t k = 0; k < 2; ++k)
            if (const std::size_t body = k == 0 ? bodies.first : bodies.second; model.bodies[body].moves())
                motion[k] = find_motion(solids.bodies[body].surface_t0, state.bodies[body].surface);
        const double thinner = std::min(solids.bodies[bodies.first].thickness, solids.bodies[bodies.second].thickness);
        report.unproven_solids += find_relative_way(motion[0], motion[1]) > 0.5 * thinner;
    }
}

} // namespace

void find_touches(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report) {
    std::vector<LeafPair>& pairs = solids.leaf_pairs;
    solids.touches.clear();
    solids.pressed.clear();
    std::swap(state.solids.entries, solids.entries_before);
    state.solids.entries.clear();
    pairs.clear();
    for (SolidBodyScratch& body : solids.bodies) body.surface_is_fresh = false;
    list_touching_pairs(model, state, solids);
    for (const Contact& contact : solids.coarse) {
        if (!is_between_bodies(model, contact)) continue;
        if (meet_by_surface(model, contact.body_a, contact.body_b) && is_leaf_pair(model, contact))
            pairs.push_back({contact.body_a, contact.body_b, contact.feature_a[0], contact.feature_b[0]});
    }
    probe_open_pairs(model, state.solids, solids, report);
    std::sort(pairs.begin(), pairs.end(), by_key);
    pairs.erase(std::unique(pairs.begin(), pairs.end(), [](const LeafPair& x, const LeafPair& y) { return x.key() == y.key(); }),
                pairs.end());
    std::size_t begin = 0, probes_left = kPathProbes;
    for (const auto& [a, b] : solids.meeting) {
        std::size_t end = begin;
        while (end < pairs.size() && pairs[end].a == a && pairs[end].b == b) ++end;
        const std::span<LeafPair> of_these = std::span(pairs).subspan(begin, end - begin);
        if (a != b)
            touch_bodies(model, state, a, b, of_these, probes_left, solids, report);
        else if (!of_these.empty())
            touch_self(model, state, of_these, solids, report);
        begin = end;
    }
    std::sort(state.solids.entries.begin(), state.solids.entries.end(), by_key);
    keep_touching(solids, state.solids.touching);
    count_unproven(model, state, solids, report);
}

} // namespace trocar::engine
