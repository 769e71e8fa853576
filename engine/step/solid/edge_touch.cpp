#include "engine/step/solid/edge_touch.hpp"

#include "collision/ccd/sweep.hpp"
#include "engine/step/solid/touch_rules.hpp"
#include "engine/step/tissue/surface_place.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Sine; edges that are more nearly parallel have no place where they cross: their ends meet faces.
constexpr double kLeastSine = 0.05;
/// Of an edge's length: so near to an end, it is the end that meets.
constexpr double kBesideEnd = 1e-3;
/// Of 0.1 rad, by which an edge's cone is widened: on the rim of a flat face the common normal lies on the cone's side.
constexpr double kCosineOfSide = 0.995004, kSineOfSide = 0.099833;
/// Cosine; of two places that follow one another, by which they push the same way.
constexpr double kGoesOn = 0.94;
/// Pairs of edges whose boxes are compared for one unit.
constexpr std::uint64_t kEdgePairsPerUnit = 8;

/// One edge over the step.
struct Path {
    Vec3 t0[2], t1[2]; // m
};

Path path_of(const OneWay& way, std::size_t body, Index edge) {
    const collision::Edge& v = way.model.bodies[body].topology.edges[edge];
    const std::span<const Vec3> before = way.surface_t0(body);
    const std::vector<Vec3>& now = way.surface(body);
    return {{before[v[0]], before[v[1]]}, {now[v[0]], now[v[1]]}};
}

/// m; farthest way of the edge in the step, beyond what all solids share.
double way_of(const OneWay& way, const Path& path) {
    return std::max((path.t1[0] - path.t0[0] - way.shared()).norm(), (path.t1[1] - path.t0[1] - way.shared()).norm());
}

/// What it sweeps in the step, and as far again as it came.
Box3 box_of(const OneWay& way, const Path& path) {
    Box3 box;
    for (int k : {0, 1}) {
        box.add(path.t0[k] + way.shared());
        box.add(path.t1[k]);
    }
    box.inflate(0.5 * (way.model.contact.margin + way.known_change()) + way_of(way, path));
    return box;
}

bool lies_in(const NormalCone& cone, const Vec3& direction) {
    const double sine = std::sqrt(std::max(0.0, 1.0 - cone.cosine * cone.cosine));
    return direction.dot(cone.axis) >= cone.cosine * kCosineOfSide - sine * kSineOfSide;
}

NormalCone cone_of(const OneWay& way, std::size_t body, Index edge) {
    return cone_of_edge(way.solids.bodies[body].adjacency, way.model.bodies[body].topology, edge, way.surface(body));
}

/// The next step, if the edge goes on as in this one.
Path go_on(const OneWay& way, std::size_t body, const Path& path) {
    const Vec3& change = way.solids.bodies[body].change;
    return {{path.t1[0], path.t1[1]}, {path.t1[0] + (path.t1[0] - path.t0[0]) + change, path.t1[1] + (path.t1[1] - path.t0[1]) + change}};
}

Vec3 between(const Vec3 (&end)[2], double along) { return (1.0 - along) * end[0] + along * end[1]; }

collision::Sweep sweep(const Path& own, const Path& other) {
    const auto swept = [](const Path& path) { return std::array<collision::SweptPoint, 2>{{{path.t0[0], path.t1[0]}, {path.t0[1], path.t1[1]}}}; };
    return collision::sweep_edge_edge(swept(own), swept(other), {});
}

/// Did the two pass through one another in this step, from the side on which they belong?
bool have_crossed(const Path& own, const Path& other, const Vec3& normal) {
    Vec3 before = (own.t0[1] - own.t0[0]).cross(other.t0[1] - other.t0[0]);
    const Vec3 now = (own.t1[1] - own.t1[0]).cross(other.t1[1] - other.t1[0]);
    if (now.dot(normal) < 0.0) before = -before;
    if (!(before.dot(own.t0[0] - other.t0[0]) >= -kOnSurface * before.norm())) return false;
    return sweep(own, other).hit();
}

std::optional<EdgePlace> place(const OneWay& way, Index own, Index other, const Path& at, const Path& there) {
    const Vec3 along = at.t1[1] - at.t1[0], across = there.t1[1] - there.t1[0];
    const Vec3 common = along.cross(across);
    const double common_sq = common.squaredNorm();
    if (!(common_sq > kLeastSine * kLeastSine * along.squaredNorm() * across.squaredNorm())) return std::nullopt;
    const Vec3 between = there.t1[0] - at.t1[0];
    EdgePlace found;
    found.s = between.cross(across).dot(common) / common_sq;
    found.t = between.cross(along).dot(common) / common_sq;
    if (!(found.s >= 0.0 && found.s <= 1.0 && found.t >= 0.0 && found.t <= 1.0)) return std::nullopt;
    const NormalCone cone = cone_of(way, way.other, other);
    found.normal = common / std::sqrt(common_sq);
    if (found.normal.dot(cone.axis) < 0.0) found.normal = -found.normal;
    if (!lies_in(cone, found.normal) || !lies_in(cone_of(way, way.own, own), -found.normal)) return std::nullopt;
    found.point = there.t1[0] + found.t * across;
    found.gap = found.normal.dot(at.t1[0] + found.s * along - found.point);
    return found;
}

/// m; how far the two places may come against each other in the next step, if they go on as in this one.
double reach_of(const OneWay& way, const Path& at, const Path& there, const EdgePlace& found) {
    const auto moved = [&](const Path& path, double along) {
        return ((1.0 - along) * (path.t1[0] - path.t0[0]) + along * (path.t1[1] - path.t0[1]) - way.shared()).norm();
    };
    return way.model.contact.margin + moved(at, found.s) + moved(there, found.t) + way.known_change();
}

/// Are two edges that cross as they stand to be listed? Within the margin, where their plane does not hold them as they go, and where they meet on
/// that way; not where they pass beside one another.
bool needs_plane(const OneWay& way, const Path& at, const Path& there, const EdgePlace& found) {
    if (found.gap <= way.model.contact.margin) return true;
    const Path next = go_on(way, way.own, at), next_there = go_on(way, way.other, there);
    if (found.normal.dot(between(next.t1, found.s) - between(next_there.t1, found.t)) >= 0.0) return true;
    return sweep(next, next_there).hit();
}

/// Does what one edge sweeps, as the other one sees it, come where that one is?
bool come_near(const Path& own, const Path& other) {
    const Vec3 way[2] = {other.t1[0] - other.t0[0], other.t1[1] - other.t0[1]};
    const Vec3 mean = 0.5 * (way[0] + way[1]);
    Box3 swept, there;
    for (int k : {0, 1}) {
        swept.add(own.t0[k]);
        swept.add(own.t1[k] - mean);
        there.add(other.t0[k]);
    }
    there.inflate((0.5 * (way[1] - way[0])).norm());
    return swept.overlaps(there);
}

/// Where two edges that do not cross as they stand will meet in the next step.
std::optional<EdgePlace> find_coming(const OneWay& way, Index own, Index other, const Path& at, const Path& there) {
    const Path next = go_on(way, way.own, at), next_there = go_on(way, way.other, there);
    if (!come_near(next, next_there)) return std::nullopt;
    const collision::Sweep met = sweep(next, next_there);
    if (!met.hit() || met.outcome == collision::SweepOutcome::StartsTouching) return std::nullopt;
    EdgePlace found;
    found.s = met.bary[0], found.t = met.bary[1];
    if (!(std::min({found.s, found.t, 1.0 - found.s, 1.0 - found.t}) > kBesideEnd)) return std::nullopt; // an end of theirs meets
    const auto then = [&](const Path& path) { return Vec3((1.0 - met.time) * (path.t0[1] - path.t0[0]) + met.time * (path.t1[1] - path.t1[0])); };
    const Vec3 along = then(next), across = then(next_there), common = along.cross(across);
    if (!(common.squaredNorm() > kLeastSine * kLeastSine * along.squaredNorm() * across.squaredNorm())) return std::nullopt;
    found.point = between(there.t1, found.t);
    const Vec3 apart = between(at.t1, found.s) - found.point;
    found.normal = common.normalized();
    if (found.normal.dot(apart) < 0.0) found.normal = -found.normal;
    found.gap = found.normal.dot(apart);
    if (!lies_in(cone_of(way, way.other, other), found.normal) || !lies_in(cone_of(way, way.own, own), -found.normal)) return std::nullopt;
    return found;
}

/// fast   it was seen to come in, and goes back as fast as a vertex that was
void add(const OneWay& way, Index own, Index other, const EdgePlace& found, bool fast) {
    SolidScratch& solids = way.solids;
    if (fast && found.gap < -way.model.contact.margin) solids.pressed.push_back(solids.touches.size());
    solids.touches.push_back(make_edge_touch(way, own, other, found));
}

/// As the key of a place where two edges cross needs it.
SolidContact name_edges(const OneWay& way, Index own, Index other) {
    SolidContact named;
    named.touch.a = Thing::body(way.own), named.touch.b = Thing::body(way.other);
    for (std::size_t k : {0u, 1u}) {
        named.touch.feature_a[k] = way.model.bodies[way.own].topology.edges[own][k];
        named.touch.feature_b[k] = way.model.bodies[way.other].topology.edges[other][k];
    }
    return named;
}

/// By the two bodies, in which order contacts stand.
struct BetweenBodies {
    using Bodies = std::pair<Thing, Thing>;
    bool operator()(const SolidContact& x, const Bodies& wanted) const { return Bodies(x.touch.a, x.touch.b) < wanted; }
    bool operator()(const Bodies& wanted, const SolidContact& x) const { return wanted < Bodies(x.touch.a, x.touch.b); }
};

/// Did the two touch in the last step?
bool touched_before(const OneWay& way, Index own, Index other) {
    const SolidContact wanted = name_edges(way, own, other);
    const std::vector<SolidContact>& before = way.solids.contacts_before;
    const auto found = std::lower_bound(before.begin(), before.end(), wanted, kByKey);
    return found != before.end() && found->key() == wanted.key() && is_touching(found->touch);
}

/// Those of the last step that list places of one body at another.
std::span<const SolidContact> contacts_before(const OneWay& way, std::size_t a, std::size_t b) {
    const auto [first, last] = std::equal_range(way.solids.contacts_before.begin(), way.solids.contacts_before.end(), std::pair(Thing::body(a), Thing::body(b)), BetweenBodies{});
    return {first, last};
}

/// Does a place that touched in the last step go on where these two edges cross? It shares a vertex of each and pushed the same way: a block's edge that
/// slides along a table's rim comes from one edge of that to the next.
bool goes_on_there(const OneWay& way, Index own, Index other, const EdgePlace& found, double reach) {
    const collision::Edge &ends = way.model.bodies[way.own].topology.edges[own], &ends_there = way.model.bodies[way.other].topology.edges[other];
    const auto shares = [](std::span<const Index> corners, const collision::Edge& edge) {
        return std::any_of(corners.begin(), corners.end(), [&](Index v) { return v == edge[0] || v == edge[1]; });
    };
    const auto goes_on = [&](bool same, const SolidContact& before) {
        const Contact& touch = before.touch;
        return is_touching(touch) && found.gap >= touch.gap - reach && (same ? 1.0 : -1.0) * touch.normal.dot(found.normal) > kGoesOn &&
               shares(touch.feature_a, same ? ends : ends_there) && shares(touch.feature_b, same ? ends_there : ends);
    };
    const auto any = [&](bool same, std::span<const SolidContact> between) {
        return std::any_of(between.begin(), between.end(), [&](const SolidContact& before) { return goes_on(same, before); });
    };
    return any(true, contacts_before(way, way.own, way.other)) || any(false, contacts_before(way, way.other, way.own));
}

} // namespace

SharpEdges list_sharp_edges(const BodyModel& body) {
    const collision::SurfaceTopology& topology = body.topology;
    const spheretree::SphereTree& tree = body.covering.tree;
    SharpEdges out;
    out.is_sharp.assign(topology.edges.size(), 0);
    for (const Index e : body.sharp_edges) out.is_sharp[e] = 1;
    out.count = body.sharp_edges.size();
    std::vector<Index> here;
    out.leaf_begin.push_back(0);
    for (Index s = 0; s < tree.sphere_count(); ++s) {
        here.clear();
        if (tree.is_leaf(s))
            for (const Index t : tree.items_of(s))
                for (const Index e : topology.triangle_edges[t])
                    if (out.has(e)) here.push_back(e);
        std::sort(here.begin(), here.end());
        here.erase(std::unique(here.begin(), here.end()), here.end());
        out.edge.insert(out.edge.end(), here.begin(), here.end());
        out.leaf_begin.push_back(static_cast<Index>(out.edge.size()));
    }
    return out;
}

std::optional<EdgePlace> place_edges(const OneWay& way, Index own, Index other) {
    return place(way, own, other, path_of(way, way.own, own), path_of(way, way.other, other));
}

Contact make_edge_touch(const OneWay& way, Index own, Index other, const EdgePlace& at) {
    Contact touch = name_edges(way, own, other).touch;
    touch.origin = ContactOrigin::Proximity;
    touch.point = at.point;
    touch.normal = at.normal;
    touch.gap = at.gap;
    touch.bary_a[0] = 1.0 - at.s, touch.bary_a[1] = at.s;
    touch.bary_b[0] = 1.0 - at.t, touch.bary_b[1] = at.t;
    return touch;
}

std::uint64_t edge_units(const SharpEdges& a, Index leaf_a, const SharpEdges& b, Index leaf_b) {
    return (a.beneath(leaf_a).size() * b.beneath(leaf_b).size() + kEdgePairsPerUnit - 1) / kEdgePairsPerUnit;
}

void touch_edges(const OneWay& way, std::size_t first_touch, LeafPair& pair) {
    SolidScratch& solids = way.solids;
    const std::span<const Index> edges = solids.bodies[way.own].sharp.beneath(pair.leaf_a);
    const std::span<const Index> edges_there = solids.bodies[way.other].sharp.beneath(pair.leaf_b);
    if (edges.empty() || edges_there.empty()) return;
    Box3 all;
    solids.edge_boxes.clear();
    for (const Index f : edges_there) {
        solids.edge_boxes.push_back(box_of(way, path_of(way, way.other, f)));
        all.add(solids.edge_boxes.back());
    }
    for (const Index e : edges) {
        const Path at = path_of(way, way.own, e);
        const Box3 box = box_of(way, at);
        if (!box.overlaps(all)) continue;
        for (std::size_t k = 0; k < edges_there.size(); ++k) {
            if (!box.overlaps(solids.edge_boxes[k])) continue;
            const Index f = edges_there[k];
            const Path there = path_of(way, way.other, f);
            const auto crossing = place(way, e, f, at, there);
            const auto found = crossing ? crossing : find_coming(way, e, f, at, there);
            if (!found) continue;
            const double reach = reach_of(way, at, there, *found);
            if (found->gap > reach) continue;
            if (crossing && !needs_plane(way, at, there, *found)) continue;
            if (!crossing || !touched_before(way, e, f)) { // else touch_edges_before has it
                if (found->gap < 0.0 && !have_crossed(at, there, found->normal) && !goes_on_there(way, e, f, *found, reach)) continue;
                if (!is_listed(way, first_touch, e, f)) add(way, e, f, *found, true);
            }
            pair.gap = std::min(pair.gap, found->gap);
        }
    }
}

void touch_edges_before(const OneWay& way, std::size_t first_touch) {
    for (const SolidContact& before : contacts_before(way, way.own, way.other)) {
        const Contact& touch = before.touch;
        if (!touch.between_edges() || !is_touching(touch)) continue;
        const Index own = collision::find_edge(way.model.bodies[way.own].topology, touch.feature_a[0], touch.feature_a[1]);
        const Index other = collision::find_edge(way.model.bodies[way.other].topology, touch.feature_b[0], touch.feature_b[1]);
        if (!way.solids.bodies[way.own].sharp.has(own) || !way.solids.bodies[way.other].sharp.has(other)) continue; // seen where it pierces
        if (is_listed(way, first_touch, own, other)) continue;
        const Path at = path_of(way, way.own, own), there = path_of(way, way.other, other);
        if (const auto found = place(way, own, other, at, there); found && found->gap <= reach_of(way, at, there, *found))
            add(way, own, other, *found, before.recovery >= kRecovery || touch.gap >= -way.model.contact.margin);
    }
}

bool is_listed(const OneWay& way, std::size_t first_touch, Index own, Index other) {
    const SolidContact wanted = name_edges(way, own, other);
    return std::any_of(way.solids.touches.begin() + static_cast<std::ptrdiff_t>(first_touch), way.solids.touches.end(),
                       [&](const Contact& touch) { return SolidContact{touch}.key() == wanted.key(); });
}

bool cross_there(const SolidScratch& solids, std::size_t first_touch, std::size_t body, const Piercing& in, const Piercing& out) {
    const double aside = 0.5 * (out.s - in.s);
    for (std::size_t k = first_touch; k < solids.touches.size(); ++k) {
        const Contact& touch = solids.touches[k];
        if (!touch.between_edges() || touch.gap > 0.0) continue;
        const bool is_a = touch.a == Thing::body(body);
        const Index* edge = is_a ? touch.feature_a : touch.feature_b;
        const double along = is_a ? touch.bary_a[1] : touch.bary_b[1];
        if (edge[0] == in.v0 && edge[1] == in.v1 && along >= in.s - aside && along <= out.s + aside) return true;
    }
    return false;
}

} // namespace trocar::engine
