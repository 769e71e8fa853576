#include "engine/step/instrument/wall_exchange.hpp"

#include "engine/step/tissue/surface_place.hpp"
#include "engine/step/tissue/surface_spring.hpp"

#include <algorithm>
#include <array>

namespace trocar::engine {

namespace {

/// Weights of the nodes of its wall in a press's place, the turns of links left out; of a corner beside its tetrahedron some are negative. visit(node, weight)
template <class Visit>
void for_each_node(const BodyModel& wall, const WallPress& press, Visit&& visit) {
    const fem::RigidLinks& links = *wall.links;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const Index vertex = wall.surface.triangles[press.triangle][corner];
        const std::span<const Index> nodes = links.nodes_of(links.vertex_frame[vertex]);
        for (std::size_t k = 0; k < nodes.size(); ++k)
            visit(nodes[k], links.vertex_blend[vertex] * links.weights_of(vertex)[k] * press.bary[corner]);
    }
}

/// What a press of 1 N along a direction puts on the nodes of its wall, as integration feels it.
struct NodeShares {
    NodeShares(const BodyModel& wall, const WallPress& press, const Vec3& direction, std::span<const Vec3> nodes) {
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const fem::LinkForces spread =
                fem::spread_link_force(*wall.links, wall.surface.triangles[press.triangle][corner], nodes, press.bary[corner] * direction);
            for (std::size_t k = 0; k < fem::kMostLinkNodes; ++k)
                if (spread.node[k] != kNoIndex) add(spread.node[k], spread.force[k]);
        }
    }
    void add(Index node, const Vec3& force) {
        std::size_t k = 0;
        while (k < count && entry[k].node != node) ++k;
        if (k == count) entry[count++] = {node, Vec3::Zero()};
        entry[k].force += force;
    }
    struct Entry {
        Index node;
        Vec3 force; // [-]
    };
    std::array<Entry, 3 * fem::kMostLinkNodes> entry;
    std::size_t count = 0;
};

bool are_of_one_side(const fem::RodPlane& a, const fem::RodPlane& b) noexcept { return a.node == b.node && a.weight == b.weight && a.side == b.side; }

/// m/s; the mean of what holds a wall's body, or else the organ that it is joined to: what stiffness takes a node back to moves so.
Vec3 find_held_velocity(const SceneModel& model, std::size_t lumen, const State& state) {
    const std::size_t body = *model.bodies[lumen].host_body;
    const bool by_organ = model.bodies[body].joint && model.bodies[body].tissue->pinned.empty();
    const std::size_t host = by_organ ? model.bodies[body].joint->host : body;
    const std::vector<Index>& pinned = model.bodies[host].tissue->pinned;
    Vec3 sum = Vec3::Zero();
    for (const Index node : pinned) sum += state.bodies[host].tissue.velocity[node];
    return pinned.empty() ? sum : Vec3(sum / static_cast<double>(pinned.size()));
}

/// m; where a wall's place is going by itself: with what holds its body, and by its nodes' inertia beside that. held: m/s
Vec3 find_coming(const SceneModel& model, std::size_t lumen, const WallPress& press, const Vec3& held, const State& state) {
    const BodyModel& wall = model.bodies[lumen];
    const BodyModel& host = model.bodies[*wall.host_body];
    const std::vector<Vec3>& velocity = state.bodies[*wall.host_body].tissue.velocity;
    Vec3 coming = Vec3::Zero();
    for_each_node(wall, press, [&](Index node, double weight) {
        const double inertia = 2.0 * host.tissue->node_mass[node] / (model.step_s * model.step_s); // N/m
        const Vec3 beside = velocity[node] - held;
        coming += weight * model.step_s * (held + inertia * host.node_give[node] * beside);
    });
    return coming;
}

/// Of a wall that moves.
collision::SurfaceMotion motion_in_step(const SceneModel& model, std::size_t lumen, const State& state, const RodsScratch& rods) {
    return {&model.bodies[lumen].topology, rods.walls[lumen].surface_t0, state.bodies[lumen].surface};
}

/// Notes where a plane presses, hardest first.
void add_press(const WallPress& press, double force, WallPush& push) {
    std::size_t at = push.press_count;
    for (; at > 0 && push.share[at - 1] < force; --at)
        if (at < kPressesPerPush) push.press[at] = push.press[at - 1], push.share[at] = push.share[at - 1];
    if (at == kPressesPerPush) return;
    push.press[at] = press, push.share[at] = force;
    push.press_count = std::min(push.press_count + 1, kPressesPerPush);
}

/// What the planes of the look ahead dragged with at the end of the step before the last, plane by plane, N. They are those of the last step that give.
class EarlierDrag {
public:
    explicit EarlierDrag(const InstrumentScratch& own) noexcept : own_(own) {}
    [[nodiscard]] const Vec3& next() noexcept {
        while (!(own_.last_presses[at_].give > 0.0)) ++at_;
        return own_.last_planes[at_++].start_drag;
    }

private:
    const InstrumentScratch& own_;
    std::size_t at_ = 0;
};

/// Of one side of a place, if its planes push: each where it presses. Returns the first plane of the next side. The tissue is dragged by the mean of two
/// steps' friction: what moves it turns the next step's round, and each by itself would move it to and fro for good.
std::size_t find_push(const InstrumentState& now, std::size_t from, EarlierDrag& earlier, WallPush& push) {
    const fem::RodPlane& first = now.planes[from];
    push = WallPush{.node = first.node, .weight = first.weight};
    push.side = first.side;
    std::size_t k = from;
    for (; k < now.planes.size() && are_of_one_side(now.planes[k], first); ++k) {
        const fem::RodPlane& plane = now.planes[k];
        const Vec3& earlier_drag = earlier.next();
        if (!(plane.force > 0.0) || now.presses[k].triangle == kNoIndex) continue;
        push.force += plane.force * plane.normal;
        push.drag += 0.5 * (plane.drag + earlier_drag);
        const double give = now.presses[k].give;
        if (give > 0.0) push.give = give, push.felt = plane.felt, push.is_rigid = plane.give == 0.0;
        add_press(now.presses[k], plane.force, push);
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < push.press_count; ++i) sum += push.share[i];
    for (std::size_t i = 0; i < push.press_count; ++i) push.share[i] /= sum;
    return k;
}

/// Lists what pushes, and how many places each node of the walls carries.
void find_pushes(const SceneModel& model, const State& state, RodsScratch& rods) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const BodyModel& wall = model.bodies[model.instruments[i].lumen];
        if (!wall.host_body) continue;
        std::vector<double>& count = rods.walls[model.instruments[i].lumen].node_presses;
        count.resize(model.bodies[*wall.host_body].node_give.size(), 0.0);
        const InstrumentState& now = state.instruments[i];
        const Vec3 held = find_held_velocity(model, model.instruments[i].lumen, state);
        WallPush push;
        EarlierDrag earlier(rods.instruments[i]);
        for (std::size_t k = 0; k < now.planes.size();) {
            k = find_push(now, k, earlier, push);
            for (std::size_t at = 0; at < push.press_count; ++at) {
                for_each_node(wall, push.press[at], [&](Index node, double weight) { count[node] += push.share[at] * std::abs(weight); });
                push.coming += push.share[at] * find_coming(model, model.instruments[i].lumen, push.press[at], held, state);
            }
            if (push.press_count == 0) continue;
            rods.instruments[i].pushes.push_back(push); // reserved
        }
    }
}

/// A force on the wall's place along a direction: from `start` to `end` (N) over the step, less what `stiffness` takes from it as the place goes along.
void add_push(const SceneModel& model, std::size_t lumen, const WallPush& push, const Vec3& direction, double start, double end, const State& state,
              BodiesScratch& bodies) {
    const double stiffness = 1.0 / push.give;
    std::array<Index, 3 * kPressesPerPush> vertices;
    std::array<double, 3 * kPressesPerPush> weights;
    for (std::size_t i = 0; i < push.press_count; ++i)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            vertices[3 * i + corner] = model.bodies[lumen].surface.triangles[push.press[i].triangle][corner];
            weights[3 * i + corner] = push.share[i] * push.press[i].bary[corner];
        }
    SurfacePush spring{lumen, std::span(vertices).first(3 * push.press_count), std::span(weights).first(3 * push.press_count), direction, -start / stiffness,
                       stiffness};
    spring.rate = (start - end) / (stiffness * model.step_s);
    add_surface_spring(model, spring, state, bodies);
}

/// The linear answer's axes: against what pushes, where it never pulls, and across that, where it does both.
struct Axes {
    explicit Axes(const WallPush& push) : along(-spheretree::direction_of(push.force)) {
        const Vec3 beside = std::abs(along.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
        across[0] = spheretree::direction_of(along.cross(beside));
        across[1] = along.cross(across[0]);
    }
    Vec3 along, across[2];
};

/// N, on the wall; at the step's end, where that has not moved.
Vec3 end_force(const WallPush& push) noexcept {
    const Vec3 pushed = push.coming / push.give - push.force;
    return push.is_rigid ? pushed : Vec3(pushed + push.felt - push.force);
}

void push_wall(const SceneModel& model, std::size_t lumen, const WallPush& push, const State& state, BodiesScratch& bodies) {
    const Axes axes(push);
    const Vec3 end = end_force(push);
    const auto push_along = [&](const Vec3& axis) { add_push(model, lumen, push, axis, -axis.dot(push.felt), axis.dot(end), state, bodies); };
    push_along(axes.along);
    for (const Vec3& axis : axes.across) push_along(axis), push_along(-axis);
    const double drag = std::sqrt(push.drag.squaredNorm());
    if (drag > 0.0) add_push(model, lumen, push, -push.drag / drag, drag, drag, state, bodies);
}

} // namespace

Vec3 find_wall_way(const SceneModel& model, std::size_t lumen, const WallPress& press, const State& state, const RodsScratch& rods) {
    const Triangle& t = model.bodies[lumen].surface.triangles[press.triangle];
    Vec3 way = Vec3::Zero();
    for (std::size_t c = 0; c < 3; ++c) way += press.bary[c] * (state.bodies[lumen].surface[t[c]] - rods.walls[lumen].surface_t0[t[c]]);
    return way;
}

double find_wall_give(const SceneModel& model, std::size_t lumen, const WallPress& press, const RodsScratch& rods) noexcept {
    const BodyModel& wall = model.bodies[lumen];
    if (!wall.host_body || !rods.tissue_moves || press.triangle == kNoIndex) return 0.0;
    const std::vector<double>& give = model.bodies[*wall.host_body].node_give;
    const std::vector<double>& count = rods.walls[lumen].node_presses;
    double sum = 0.0;
    for_each_node(wall, press, [&](Index node, double weight) { sum += std::abs(weight) * give[node] * std::max(1.0, node < count.size() ? count[node] : 0.0); });
    return std::max(sum, 1.0 / model.contact.wall_stiffness);
}

void move_planes(const SceneModel& model, State& state) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const std::size_t lumen = model.instruments[i].lumen;
        InstrumentState& now = state.instruments[i];
        if (!model.bodies[lumen].host_body) continue;
        const Vec3 held = find_held_velocity(model, lumen, state);
        std::size_t kept = 0;
        for (std::size_t k = 0; k < now.planes.size(); ++k) {
            if (!(now.presses[k].give > 0.0)) continue;
            now.planes[k].offset += now.planes[k].normal.dot(find_coming(model, lumen, now.presses[k], held, state));
            now.planes[kept] = now.planes[k];
            now.presses[kept++] = now.presses[k];
        }
        now.planes.resize(kept);
        now.presses.resize(kept);
    }
}

void carry_planes(const SceneModel& model, std::size_t index, State& state, const RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    const InstrumentScratch& scratch = rods.instruments[index];
    InstrumentState& now = state.instruments[index];
    if (!model.bodies[instrument.lumen].moves()) return;
    const bool went_ahead = rods.tissue_moves && model.bodies[instrument.lumen].host_body; // see move_planes
    for (std::size_t k = 0, last = 0; k < now.planes.size(); ++k, ++last) {
        while (went_ahead && !(scratch.last_presses[last].give > 0.0)) ++last;
        fem::RodPlane& plane = now.planes[k];
        plane.offset = scratch.last_planes[last].offset + plane.normal.dot(find_wall_way(model, instrument.lumen, now.presses[k], state, rods));
        plane.felt.setZero();
    }
    for (const WallPush& push : scratch.pushes) {
        const Vec3 felt = felt_of(push, way_of(push, motion_in_step(model, instrument.lumen, state, rods)));
        for (fem::RodPlane& plane : now.planes)
            if (plane.node == push.node && plane.weight == push.weight && plane.side == push.side) plane.felt += felt;
    }
}

double find_exact_give(const SceneModel& model, std::size_t lumen, const WallPress& press, const Vec3& normal, const State& state, const RodsScratch& rods) {
    const BodyModel& wall = model.bodies[lumen];
    if (!wall.host_body || !rods.tissue_moves || press.triangle == kNoIndex) return 0.0;
    const std::vector<double>& give = model.bodies[*wall.host_body].node_give;
    const std::vector<double>& count = rods.walls[lumen].node_presses;
    const NodeShares shares(wall, press, normal, state.bodies[*wall.host_body].tissue.position);
    double sum = 0.0;
    for (std::size_t k = 0; k < shares.count; ++k) {
        const auto& [node, force] = shares.entry[k];
        sum += force.squaredNorm() * give[node] * std::max(1.0, node < count.size() ? count[node] : 0.0);
    }
    return std::max(sum, 1.0 / model.contact.wall_stiffness);
}

void push_walls(const SceneModel& model, const State& state, BodiesScratch& bodies, RodsScratch& rods) {
    for (InstrumentScratch& instrument : rods.instruments) instrument.pushes.clear();
    for (WallScratch& wall : rods.walls) wall.node_presses.clear();
    if (!rods.tissue_moves) return;
    find_pushes(model, state, rods);
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        for (WallPush& push : rods.instruments[i].pushes) {
            const std::size_t lumen = model.instruments[i].lumen;
            push_wall(model, lumen, push, state, bodies);
        }
}

double find_exchange_gap(const SceneModel& model, std::size_t instrument, const State& state, const RodsScratch& rods) {
    const std::size_t lumen = model.instruments[instrument].lumen;
    const BodyModel& wall = model.bodies[lumen];
    if (!rods.tissue_moves || !wall.host_body) return 0.0;
    Vec3 gap = Vec3::Zero();
    for (const fem::RodPlane& plane : state.instruments[instrument].planes)
        if (plane.force > 0.0) gap += plane.force * plane.normal + plane.drag;
    const collision::SurfaceMotion motion = motion_in_step(model, lumen, state, rods);
    for (const WallPush& push : rods.instruments[instrument].pushes) gap -= felt_of(push, way_of(push, motion)) + push.drag;
    return std::sqrt(gap.squaredNorm());
}

Vec3 way_of(const WallPush& push, const collision::SurfaceMotion& wall) noexcept {
    Vec3 way = Vec3::Zero();
    for (std::size_t i = 0; i < push.press_count; ++i) {
        const Triangle& t = wall.topology->triangles[push.press[i].triangle];
        way += push.share[i] * (point_on(t, push.press[i].bary, wall.t1) - point_on(t, push.press[i].bary, wall.t0));
    }
    return way;
}

Vec3 felt_of(const WallPush& push, const Vec3& moved) noexcept {
    const Axes axes(push);
    const Vec3 on_wall = end_force(push) - moved / push.give;
    const double along = axes.along.dot(on_wall);
    return along < 0.0 ? Vec3(along * axes.along - on_wall) : Vec3(-on_wall);
}

} // namespace trocar::engine
