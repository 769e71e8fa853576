#include "engine/step/contact/contact_rows.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/prepare/scripted_motion.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// [vertex_count] the tetrahedron beneath each vertex of the surface; kNoIndex: none
std::vector<Index> find_vertex_tets(const BodyModel& body, const fem::TissueModel& tissue) {
    const fem::NodeTets around(tissue.tet_nodes, tissue.node_count());
    const fem::RigidLinks& links = *body.links;
    std::vector<Index> out;
    for (Index v = 0; v < links.vertex_count(); ++v)
        out.push_back(fem::find_tet_beneath(tissue.tet_nodes, tissue.rest_position, around, links.nodes_of(links.vertex_frame[v]), body.surface.vertices[v]).tet);
    return out;
}

/// One side of a place that is a mean of vertices.
struct Mean {
    std::size_t body;
    std::span<const Index> vertices;
    std::span<const double> weights; // sum 1
};

/// Smallest coordinate of a place in the tetrahedron of a corner of its, above which that one stands for all of them.
constexpr double kBesideTet = -0.5;

/// Puts a foot of the side on a tetrahedron; false: it cannot stand there.
bool add_foot(const fem::TissueModel& tissue, Index tet, const Vec3& place, const Vec3& rest_place, double share,
              const std::vector<Vec3>& now, ContactSide& side) {
    Vec3 x[4], rest[4];
    for (std::size_t k = 0; k < 4; ++k) {
        const Index node = tissue.tet_nodes[tet][k];
        x[k] = now[node], rest[k] = tissue.rest_position[node];
        side.record[side.feet][k] = tissue.plan.record_of[node];
    }
    if (!fem::find_affine(x, place, side.weight[side.feet]) && // crushed flat: as at rest
        !fem::find_affine(rest, rest_place, side.weight[side.feet]))
        return false;
    side.share[side.feet++] = share;
    return true;
}

ContactSide make_side(const SceneModel& model, const Mean& mean, const State& state, const ContactScratch& scratch) {
    const BodyModel& body = model.bodies[mean.body];
    const std::vector<Vec3>&dense = state.bodies[mean.body].surface, &dense_rest = body.surface.vertices;
    ContactSide side;
    side.owner = owner_of(model, mean.body);
    Vec3 place = Vec3::Zero(), rest_place = Vec3::Zero();
    std::size_t heaviest = 0;
    for (std::size_t k = 0; k < mean.vertices.size(); ++k) {
        place += mean.weights[k] * dense[mean.vertices[k]];
        rest_place += mean.weights[k] * dense_rest[mean.vertices[k]];
        if (mean.weights[k] > mean.weights[heaviest]) heaviest = k;
    }
    side.start = place;
    if (body.motion == Motion::Kinematic)
        side.velocity = (evaluate_motion(body.path, state.time + model.step_s) - evaluate_motion(body.path, state.time)) / model.step_s;
    const std::vector<Index>& tets = scratch.vertex_tet[mean.body];
    if (!body.links || tets.empty()) return side;
    const fem::TissueModel& tissue = *model.bodies[side.owner].tissue;
    const std::vector<Vec3>& now = state.bodies[side.owner].tissue.position;
    const Index own = tets[mean.vertices[heaviest]];
    if (own != kNoIndex && add_foot(tissue, own, place, rest_place, 1.0, now, side) &&
        mean.vertices.size() > 1 && *std::min_element(side.weight[0], side.weight[0] + 4) < kBesideTet)
        side.feet = 0; // it lies over other tetrahedra: it goes as its corners do
    if (side.feet == 0) {
        double carried = 0.0;
        for (std::size_t k = 0; k < mean.vertices.size(); ++k) {
            const Index v = mean.vertices[k];
            if (tets[v] != kNoIndex && mean.weights[k] != 0.0 &&
                add_foot(tissue, tets[v], dense[v], dense_rest[v], mean.weights[k], now, side))
                carried += mean.weights[k];
        }
        for (std::size_t foot = 0; foot < side.feet; ++foot) side.share[foot] /= carried;
    }
    if (side.feet == 0) return side;
    side.blend = 0.0;
    for (std::size_t k = 0; k < mean.vertices.size(); ++k) side.blend += mean.weights[k] * body.links->vertex_blend[mean.vertices[k]];
    side.start = side.image([&](Index record) { return now[tissue.plan.node_of[record]]; });
    return side;
}

Vec3 find_motion(const SceneModel& model, const ContactSide& side, double time, const State& state) noexcept {
    if (!side.gives()) return time * side.velocity;
    const fem::ForcePlan& plan = model.bodies[side.owner].tissue->plan;
    const std::vector<Vec3>& now = state.bodies[side.owner].tissue.position;
    return side.blend * (side.image([&](Index record) { return now[plan.node_of[record]]; }) - side.start);
}

} // namespace

void prepare_contact(const SceneModel& model, ContactScratch& scratch) {
    scratch.vertex_tet.resize(model.bodies.size());
    scratch.slot.resize(model.bodies.size());
    std::size_t places = 0;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        if (body.hollow || !can_touch_any(model, i)) continue; // a state may hold places that another response found
        places += reserved_places(body);
        if (body.links) scratch.vertex_tet[i] = find_vertex_tets(body, *model.bodies[owner_of(model, i)].tissue);
    }
    scratch.rows.reserve(places);
    scratch.solved.reserve(places);
    scratch.row_of.reserve(places);
    scratch.bodies.reserve(model.bodies.size());
}

void make_rows(const SceneModel& model, const State& state, ContactScratch& scratch) {
    scratch.rows.clear();
    for (const SolidContact& contact : state.solids.contacts) {
        const Contact& touch = contact.touch;
        const std::size_t corners = touch.feature_a[1] == kNoIndex ? 1 : 2;
        ContactRow row;
        row.a = make_side(model, {touch.a.index(), std::span(touch.feature_a).first(corners), std::span(touch.bary_a).first(corners)}, state,
                          scratch);
        const std::size_t there = touch.between_edges() ? 2 : 3;
        row.b = make_side(model, {touch.b.index(), std::span(touch.feature_b).first(there), std::span(touch.bary_b).first(there)}, state,
                          scratch);
        row.normal = touch.normal;
        row.gap = touch.gap;
        row.recovery = contact.recovery;
        row.friction = model.contact.solid_friction;
        row.room = contact.room;
        scratch.rows.push_back(row);
    }
}

double find_gap(const SceneModel& model, const ContactRow& row, double time, const State& state) noexcept {
    return row.gap + row.normal.dot(find_motion(model, row.a, time, state) - find_motion(model, row.b, time, state));
}

} // namespace trocar::engine
