#include "engine/step/solid_touch.hpp"

#include "engine/step/self_touch.hpp"
#include "engine/step/solid_probe.hpp"
#include "engine/step/solid_trees.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace seldinger::engine {

namespace {

/// m; nearer than this the way to the closest point is rounding, and the triangle's normal says which way is out.
constexpr double kNoWay = 1e-9;

/// A place of a surface: a vertex, or a point of an edge.
struct Probe {
    Index vertex[2] = {kNoIndex, kNoIndex};
    double weight[2] = {1.0, 0.0};

    [[nodiscard]] Vec3 at(const std::vector<Vec3>& surface) const {
        return vertex[1] == kNoIndex ? surface[vertex[0]] : Vec3(weight[0] * surface[vertex[0]] + weight[1] * surface[vertex[1]]);
    }
};

void find_vertex_normals(const TriMesh& mesh, const std::vector<Vec3>& surface, std::vector<Vec3>& normals) {
    normals.assign(surface.size(), Vec3::Zero());
    for (const Triangle& t : mesh.triangles) {
        const Vec3 twice_area = (surface[t[1]] - surface[t[0]]).cross(surface[t[2]] - surface[t[0]]);
        for (const Index v : t) normals[v] += twice_area;
    }
    for (Vec3& n : normals) n = spheretree::direction_of(n);
}

/// One body's places against the other's surface.
struct OneWay {
    const SceneModel& model;
    const State& state;
    StepContext& context;
    std::size_t own, other;

    [[nodiscard]] const std::vector<Vec3>& surface(std::size_t body) const { return state.bodies[body].surface; }
    [[nodiscard]] const std::vector<Vec3>& surface_t0(std::size_t body) const {
        return model.bodies[body].moves() ? context.bodies[body].surface_t0 : state.bodies[body].surface;
    }
};

Vec3 corner_sum(const std::vector<Vec3>& surface, const Triangle& t, const std::array<double, 3>& bary) {
    return bary[0] * surface[t[0]] + bary[1] * surface[t[1]] + bary[2] * surface[t[2]];
}

Vec3 face_normal(const std::vector<Vec3>& surface, const Triangle& t) {
    return spheretree::direction_of((surface[t[1]] - surface[t[0]]).cross(surface[t[2]] - surface[t[0]]));
}

/// What add_touch saw; vertex_seen holds it once a vertex was looked at.
enum Seen : std::uint8_t { kNotSeen = 0, kFar, kNear, kInside };

struct Look {
    Seen seen = kFar;
    double gap = std::numeric_limits<double>::infinity(); // m, of the touch that was listed
};

Look add_touch(const OneWay& way, const Probe& probe, double slack) {
    const InsideTest& against = way.context.bodies[way.other].inside;
    const Vec3 place = probe.at(way.surface(way.own));
    const double own_way = (place - probe.at(way.surface_t0(way.own))).norm();
    Box3 bounds = against.tree().bounds();
    bounds.inflate(slack + own_way);
    if (!bounds.contains(place)) return {};
    const bool inside = against.inside(place);
    const auto hit = inside ? against.tree().closest(place) : against.tree().closest(place, slack + own_way);
    if (!hit) return {};
    const Triangle& face = way.model.bodies[way.other].surface.triangles[hit->triangle];
    Contact touch;
    touch.body_a = static_cast<BodyId>(way.own);
    touch.body_b = static_cast<BodyId>(way.other);
    touch.origin = ContactOrigin::Proximity;
    touch.point = hit->point;
    touch.gap = inside ? -hit->distance : hit->distance;
    const Vec3 out = inside ? Vec3(hit->point - place) : Vec3(place - hit->point);
    touch.normal = hit->distance > kNoWay ? Vec3(out / hit->distance) : face_normal(way.surface(way.other), face);
    for (int k = 0; k < 2; ++k) touch.feature_a[k] = probe.vertex[k], touch.bary_a[k] = probe.weight[k];
    for (std::size_t k = 0; k < 3; ++k) touch.feature_b[k] = face[k], touch.bary_b[k] = hit->bary[k];
    const Vec3 now = corner_sum(way.surface(way.other), face, hit->bary), before = corner_sum(way.surface_t0(way.other), face, hit->bary);
    if (touch.gap > way.model.contact.margin + own_way + (now - before).norm()) return {inside ? kInside : kFar};
    if (!inside && touch.normal.dot(probe.at(way.context.bodies[way.own].vertex_normal)) > kFacing) return {};
    way.context.solids.touches.push_back(touch);
    return {inside ? kInside : kNear, touch.gap};
}

/// m, the farthest that any vertex of the body moved in the step.
double farthest_way(const OneWay& way, std::size_t body) {
    double farthest_sq = 0.0;
    if (way.model.bodies[body].moves())
        for (std::size_t v = 0; v < way.surface(body).size(); ++v)
            farthest_sq = std::max(farthest_sq, (way.surface(body)[v] - way.surface_t0(body)[v]).squaredNorm());
    return std::sqrt(farthest_sq);
}

void probe_vertices(const OneWay& way, std::span<LeafPair> pairs, bool own_is_a) {
    BodyScratch& scratch = way.context.bodies[way.own];
    const BodyModel& body = way.model.bodies[way.own];
    scratch.vertex_seen.assign(way.surface(way.own).size(), kNotSeen);
    const double slack = way.model.contact.margin + farthest_way(way, way.other);
    for (LeafPair& pair : pairs)
        for (const Index triangle : body.covering.tree.items_of(own_is_a ? pair.leaf_a : pair.leaf_b))
            for (const Index v : body.surface.triangles[triangle]) {
                if (scratch.vertex_seen[v] != kNotSeen) continue;
                const Look look = add_touch(way, {{v, kNoIndex}, {1.0, 0.0}}, slack);
                scratch.vertex_seen[v] = look.seen;
                pair.gap = std::min(pair.gap, look.gap);
            }
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
    const std::vector<std::uint8_t>&seen = way.context.bodies[way.own].vertex_seen, &seen_there = way.context.bodies[way.other].vertex_seen;
    for (const Index triangle : own.covering.tree.items_of(sphere))
        for (std::size_t k = 0; k < 3; ++k) {
            const Triangle& t = own.surface.triangles[triangle];
            const Index v0 = std::min(t[k], t[(k + 1) % 3]), v1 = std::max(t[k], t[(k + 1) % 3]);
            if (seen[v0] == kInside || seen[v1] == kInside) continue;
            Box3 box;
            box.add(at[v0]);
            box.add(at[v1]);
            way.context.bodies[way.other].inside.tree().for_each_overlapping(box, [&](Index face) {
                const Triangle& f = other.surface.triangles[face];
                if (seen_there[f[0]] == kInside || seen_there[f[1]] == kInside || seen_there[f[2]] == kInside) return;
                if (const double s = pierce(at[v0], at[v1], {faces[f[0]], faces[f[1]], faces[f[2]]}); s >= 0.0) out.push_back({v0, v1, s});
            });
        }
    return out.size() > before;
}

/// Of all spheres of one body in the pairs, each once; the pair in which one comes first keeps the place.
void list_all_piercings(const OneWay& way, std::span<LeafPair> pairs, bool own_is_a, std::vector<Piercing>& out) {
    std::vector<std::uint8_t>& seen = way.context.bodies[way.own].sphere_seen;
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
        const Probe probe{{in.v0, in.v1}, {1.0 - middle, middle}};
        if (way.context.bodies[way.other].inside.inside(probe.at(way.surface(way.own)))) (void)add_touch(way, probe, 0.0);
    }
}

/// Depths and vertex normals of this step, once for all bodies that one meets.
void refresh(const SceneModel& model, const State& state, std::size_t body, StepContext& context) {
    BodyScratch& scratch = context.bodies[body];
    if (scratch.surface_is_fresh) return;
    scratch.surface_is_fresh = true;
    if (model.bodies[body].moves()) scratch.inside.refit(state.bodies[body].surface);
    if (model.bodies[body].moves() || scratch.vertex_normal.empty())
        find_vertex_normals(model.bodies[body].surface, state.bodies[body].surface, scratch.vertex_normal);
}

void touch_bodies(const SceneModel& model, const State& state, std::span<LeafPair> pairs, StepContext& context) {
    const std::size_t a = pairs.front().a, b = pairs.front().b;
    const OneWay from_a{model, state, context, a, b}, from_b{model, state, context, b, a};
    probe_vertices(from_a, pairs, true);
    probe_vertices(from_b, pairs, false);
    std::vector<Piercing>&of_a = context.solids.piercings[0], &of_b = context.solids.piercings[1];
    list_all_piercings(from_a, pairs, true, of_a);
    list_all_piercings(from_b, pairs, false, of_b);
    probe_edges(from_a, of_a);
    probe_edges(from_b, of_b);
}

} // namespace

bool meet_by_surface(const SceneModel& model, std::size_t a, std::size_t b) noexcept {
    return model.contact.solid_response == SolidResponse::Surface && model.bodies[a].closed && model.bodies[b].closed;
}

bool is_leaf_pair(const SceneModel& model, const Contact& contact) noexcept {
    if (contact.origin == ContactOrigin::TestedSpheres) return true;
    return contact.gap < 0.0 && model.bodies[contact.body_a].covering.tree.is_leaf(contact.feature_a[0]) &&
           model.bodies[contact.body_b].covering.tree.is_leaf(contact.feature_b[0]);
}

void find_touches(const SceneModel& model, const State& state, StepContext& context) {
    std::vector<LeafPair>& pairs = context.solids.leaf_pairs;
    context.solids.touches.clear();
    pairs.clear();
    for (BodyScratch& body : context.bodies) body.surface_is_fresh = false;
    for (const Contact& contact : context.coarse) {
        if (contact.body_a >= model.bodies.size() || contact.body_b >= model.bodies.size()) continue; // an instrument's
        if (!meet_by_surface(model, contact.body_a, contact.body_b)) continue;
        refresh(model, state, contact.body_a, context);
        refresh(model, state, contact.body_b, context);
        if (is_leaf_pair(model, contact)) pairs.push_back({contact.body_a, contact.body_b, contact.feature_a[0], contact.feature_b[0]});
    }
    for (const LeafPair& pair : context.solids.remembered) // looked at again whatever the descent says
        if (pair.a == pair.b) refresh(model, state, pair.a, context);
    probe_open_pairs(model, context);
    std::sort(pairs.begin(), pairs.end(), [](const LeafPair& x, const LeafPair& y) { return x.key() < y.key(); });
    pairs.erase(std::unique(pairs.begin(), pairs.end(), [](const LeafPair& x, const LeafPair& y) { return x.key() == y.key(); }),
                pairs.end());
    for (std::size_t begin = 0; begin < pairs.size();) {
        std::size_t end = begin + 1;
        while (end < pairs.size() && pairs[end].a == pairs[begin].a && pairs[end].b == pairs[begin].b) ++end;
        const std::span<LeafPair> of_these = std::span(pairs).subspan(begin, end - begin);
        if (pairs[begin].a == pairs[begin].b)
            touch_self(model, state, of_these, context);
        else
            touch_bodies(model, state, of_these, context);
        begin = end;
    }
    remember_touching(context);
}

} // namespace seldinger::engine
