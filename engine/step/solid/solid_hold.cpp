#include "engine/prepare/thing.hpp"
#include "engine/step/solid/solid_hold.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/tissue/surface_spring.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace trocar::engine {

namespace {

/// Of what an open pair holds along its normal, so much holds it from slipping off: a plane between two spheres is as good
/// as its guess of the normal, and what stands on a guess must not slide down it.
constexpr double kHoldFriction = 0.5;

/// A spring's entries are counted in 16 bits.
constexpr std::size_t kMostEntries = 60000;

/// Adds each vertex's share of nodes beneath one sphere to `share`.
void add_vertices(const BodyModel& body, Index sphere, std::vector<double>& share) {
    double corners = 0.0;
    for (const Index triangle : body.covering.tree.items_of(sphere))
        for (const Index v : body.surface.triangles[triangle]) {
            corners += 1.0;
            const Index frame = body.links->vertex_frame[v];
            if (frame == kNoIndex) continue;
            for (std::size_t n = 0; n < 3; ++n)
                share[body.links->frame_nodes[frame][n]] += body.links->vertex_blend[v] * body.links->vertex_weight[v][n];
        }
    for (double& s : share) s /= std::max(1.0, corners);
}

/// Where a sphere stands, up to a constant: the mean of its nodes, or how far its body was carried.
Vec3 place_of(const SceneModel& model, std::size_t body, Index sphere, const State& state, const SolidScratch& solids) {
    const BodyModel& own = model.bodies[body];
    if (!own.links) {
        const bool moved = own.moves() && !own.surface.vertices.empty();
        return moved ? Vec3(state.bodies[body].surface.front() - own.surface.vertices.front()) : Vec3(Vec3::Zero());
    }
    const std::vector<Vec3>& nodes = state.bodies[owner_of(model, body)].tissue.position;
    const SphereNodes& hangs = solids.bodies[body].sphere_nodes;
    Vec3 mean = Vec3::Zero();
    for (Index k = hangs.begin[sphere]; k < hangs.begin[sphere + 1]; ++k) mean += hangs.weight[k] * nodes[hangs.node[k]];
    return mean;
}

/// Leaves that a sphere stands for.
double leaves_beneath(const spheretree::SphereTree& tree, Index sphere) {
    const double leaves = static_cast<double>(tree.sphere_count() - tree.level_begin[tree.level_count() - 1]);
    const double share = static_cast<double>(tree.item_end[sphere] - tree.item_begin[sphere]) / static_cast<double>(tree.items.size());
    return std::max(1.0, leaves * share);
}

struct SphereSide {
    std::size_t body;
    Index sphere;
    Vec3 direction; // unit, this side is pushed along it
    double rate;    // m/s, of the gap, by what scripts move
};

/// Index of the spring, kNoIndex where nothing gives way.
Index add_sphere_spring(const SceneModel& model, const SphereSide& side, double gap, double stiffness, double limit, State& state,
                        const SolidScratch& solids) {
    if (!model.bodies[side.body].links) return kNoIndex;
    const std::size_t owner = owner_of(model, side.body);
    const SphereNodes& hangs = solids.bodies[side.body].sphere_nodes;
    fem::ContactSprings& springs = state.bodies[owner].springs;
    fem::ContactSpring spring;
    spring.first_entry = static_cast<Index>(springs.entries.size());
    spring.stiffness = stiffness;
    spring.damping = model.contact.solid_damping;
    spring.limit = limit;
    spring.offset = gap;
    spring.rate = side.rate;
    for (Index k = hangs.begin[side.sphere]; k < hangs.begin[side.sphere + 1]; ++k) {
        springs.entries.push_back({hangs.node[k], hangs.weight[k] * side.direction});
        spring.offset -= springs.entries.back().g.dot(state.bodies[owner].tissue.position[hangs.node[k]]);
    }
    spring.entry_count = static_cast<std::uint16_t>(springs.entries.size() - spring.first_entry);
    if (spring.entry_count == 0) return kNoIndex;
    springs.springs.push_back(spring);
    return static_cast<Index>(springs.springs.size() - 1);
}

auto key_of(const SphereHold& hold) { return std::tie(hold.body_a, hold.body_b, hold.sphere_a, hold.sphere_b, hold.tested); }
bool by_hold_key(const SphereHold& x, const SphereHold& y) { return key_of(x) < key_of(y); }

/// Pairs that are the deepest of one of their spheres.
void choose_pairs(const SceneModel& model, SolidContactState& own, SolidScratch& solids) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        solids.bodies[i].deepest.assign(model.bodies[i].hollow ? 0 : model.bodies[i].covering.tree.sphere_count(), kNoIndex);
    const auto for_each_side = [&](const Contact& contact, auto&& see) {
        see(solids.bodies[contact.body_a].deepest[contact.feature_a[0]]);
        see(solids.bodies[contact.body_b].deepest[contact.feature_b[0]]);
    };
    const auto counts = [&](const Contact& contact) {
        if (!is_between_bodies(model, contact) || !(contact.gap < 0.0)) return false;
        if (contact.body_a == contact.body_b && contact.feature_a[0] == contact.feature_b[0]) return false; // a sphere with itself
        return !meet_by_surface(model, contact.body_a, contact.body_b);
    };
    for (Index k = 0; k < solids.coarse.size(); ++k)
        if (counts(solids.coarse[k]))
            for_each_side(solids.coarse[k], [&](Index& best) {
                if (best == kNoIndex || solids.coarse[k].gap < solids.coarse[best].gap) best = k;
            });
    for (Index k = 0; k < solids.coarse.size(); ++k) {
        const Contact& contact = solids.coarse[k];
        bool chosen = false;
        if (counts(contact)) for_each_side(contact, [&](const Index& best) { chosen = chosen || best == k; });
        if (chosen)
            own.holds.push_back({contact.body_a, contact.body_b, contact.feature_a[0], contact.feature_b[0],
                                            contact.origin == ContactOrigin::TestedSpheres, contact.normal, contact.gap});
    }
    std::sort(own.holds.begin(), own.holds.end(), by_hold_key);
}

/// m, negative: how far the two are into one another as the response counts it.
double gap_of(SphereHold& hold, double stiffness, double limit, const SceneModel& model, const State& state, const SolidScratch& solids) {
    if (hold.tested || model.contact.solid_response == SolidResponse::Spheres)
        return hold.tested ? hold.gap : std::max(hold.gap, -model.contact.assumed_depth);
    const std::vector<SphereHold>& before = solids.holds_before;
    const auto old = std::lower_bound(before.begin(), before.end(), hold, by_hold_key);
    const bool known = old != before.end() && key_of(*old) == key_of(hold);
    if (known) hold.normal = old->normal;
    const Vec3 now =
        place_of(model, hold.body_a, hold.sphere_a, state, solids) - place_of(model, hold.body_b, hold.sphere_b, state, solids);
    hold.anchor = known ? old->anchor : now;
    const double gap = hold.normal.dot(now - hold.anchor);
    const Vec3 drawn = (now - hold.anchor) - gap * hold.normal;
    const double length = drawn.norm();
    hold.hold = std::min(length, kHoldFriction * std::min(std::max(0.0, -gap), limit / stiffness));
    if (length > 0.0) {
        hold.aside = drawn / length;
        hold.anchor += drawn - hold.hold * hold.aside; // slipped: it holds on where it came to
    }
    return gap;
}

} // namespace

SphereNodes make_sphere_nodes(const SceneModel& model, std::size_t body) {
    const BodyModel& own = model.bodies[body];
    SphereNodes out;
    if (!own.links || own.hollow) return out;
    out.begin.push_back(0);
    std::vector<double> share;
    for (Index sphere = 0; sphere < own.covering.tree.sphere_count(); ++sphere) {
        share.assign(own.links->node_rest.size(), 0.0);
        add_vertices(own, sphere, share);
        const auto used = static_cast<std::size_t>(std::count_if(share.begin(), share.end(), [](double s) { return s > 0.0; }));
        const std::size_t stride = used / kMostEntries + 1; // of a body with more nodes than a spring can name, every second one
        std::size_t seen = 0;
        for (Index node = 0; node < share.size(); ++node) {
            if (!(share[node] > 0.0) || seen++ % stride != 0) continue;
            out.node.push_back(node);
            out.weight.push_back(share[node] * static_cast<double>(stride));
        }
        out.begin.push_back(static_cast<Index>(out.node.size()));
    }
    return out;
}

void push_spheres(const SceneModel& model, State& state, SolidScratch& solids) {
    SolidContactState& own = state.solids;
    std::swap(own.holds, solids.holds_before);
    own.holds.clear();
    choose_pairs(model, own, solids);
    for (std::size_t i = 0; i < model.bodies.size(); ++i) std::fill(solids.bodies[i].deepest.begin(), solids.bodies[i].deepest.end(), 0u);
    for (const SphereHold& hold : own.holds) { // from here on: pairs of each sphere
        ++solids.bodies[hold.body_a].deepest[hold.sphere_a];
        ++solids.bodies[hold.body_b].deepest[hold.sphere_b];
    }
    for (SphereHold& hold : own.holds) {
        const double leaves = std::min(leaves_beneath(model.bodies[hold.body_a].covering.tree, hold.sphere_a),
                                       leaves_beneath(model.bodies[hold.body_b].covering.tree, hold.sphere_b));
        const Index pairs =
            std::max(solids.bodies[hold.body_a].deepest[hold.sphere_a], solids.bodies[hold.body_b].deepest[hold.sphere_b]);
        const double stiffness = model.contact.solid_stiffness * leaves / static_cast<double>(pairs);
        const double limit = hold.tested ? std::numeric_limits<double>::infinity() : stiffness * model.contact.assumed_depth;
        const auto push = [&](const Vec3& direction, double gap, double most) {
            const double rate = direction.dot(solids.bodies[hold.body_a].coming - solids.bodies[hold.body_b].coming) / model.step_s;
            const Index on_a =
                add_sphere_spring(model, {hold.body_a, hold.sphere_a, direction, rate}, gap, stiffness, most, state, solids);
            const Index on_b =
                add_sphere_spring(model, {hold.body_b, hold.sphere_b, -direction, rate}, gap, stiffness, most, state, solids);
            own.springs.push_back({hold.body_a, hold.body_b, on_a, on_b, direction});
        };
        push(hold.normal, gap_of(hold, stiffness, limit, model, state, solids), limit);
        if (hold.hold > 0.0) push(-hold.aside, -hold.hold, stiffness * hold.hold);
    }
}

} // namespace trocar::engine
