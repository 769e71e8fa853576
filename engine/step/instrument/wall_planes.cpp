// Planes around a rod from its wall's own triangles, and whether a rod penetrates that wall.
#include "collision/proximity/proximity.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/instrument/wall_exchange.hpp"
#include "engine/step/instrument/wall_facets.hpp"
#include "engine/step/tissue/surface_place.hpp"
#include "engine/time/phase.hpp"
#include "fem/rod/coaxial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace trocar::engine {

namespace {

/// A push at one place takes others farther than the rod's free motion would have: by this factor and so much, until it is measured.
constexpr double kSwing = 3.0, kLeastSwing = 1e-4; // [-], m
/// m; what the distances of a search may be off by.
constexpr double kRounding = 1e-12;
/// Cosine; where what is near looks farther aside than this of the nearest, the lumen may be narrow.
constexpr double kSideways = 0.5;

/// The wall where it stood at the start of the step: what the rod was inside of.
collision::SurfaceMotion wall_before(const SceneModel& model, std::size_t body, const State& state, const RodsScratch& rods) {
    const collision::SurfaceMotion motion = wall_motion(model, body, state, rods);
    return {motion.topology, motion.t0, motion.t0};
}

/// Of the chain that the descent saw: the sphere at a node, or midway to the next.
Index link_at(const SceneModel& model, std::size_t index, Index node, double weight) {
    const Index ahead = static_cast<Index>(model.instruments[index].rod.node_count()) - 2 - node; // segments to the tip
    return 2 * ahead + (weight < 1.0 ? 1 : 0);
}

} // namespace

bool proven_free(const SceneModel& model, std::size_t index, Index node, double weight, const RodsScratch& rods) {
    const std::span<const spheretree::LinkStatus> status = rods.instruments[index].proven;
    const Index link = link_at(model, index, node, weight);
    return link < status.size() && status[link] == spheretree::LinkStatus::Free;
}

namespace {

/// What the descent proved it proved of the free motion, with the margin to spare. The solve against the planes may have taken this place
/// farther than that: pushed back at its middle, a rod swings at its ends.
bool still_proven_free(const SceneModel& model, std::size_t index, Index node, double weight, const Vec3& place,
                       const RodsScratch& rods) {
    if (!proven_free(model, index, node, weight, rods)) return false;
    const Vec3& seen = rods.instruments[index].links_t1[link_at(model, index, node, weight)].centre;
    return (place - seen).squaredNorm() <= model.contact.margin * model.contact.margin;
}

/// m; what a place keeps of its clearance: half of what a narrow lumen leaves free, or walls on both sides would press on a rod that fits.
double find_clearance(const SceneModel& model, std::size_t index, const NearList& list, const Vec3& place, const collision::SurfaceMotion& wall,
                      RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    const double radius = instrument.rod.design.radius, room = radius + model.contact.clearance;
    if (list.size() == 0) return model.contact.clearance;
    const NearTriangle& nearest = list[0];
    bool sideways = false;
    for (std::size_t k = 0; k < list.size() && !sideways; ++k) sideways = list[k].normal.dot(nearest.normal) < kSideways;
    if (!sideways) return model.contact.clearance;
    const Vec3 middle = place + (room - nearest.normal.dot(place - nearest.seen)) * nearest.normal; // just clear of the nearest
    double across = room + 2.0 * model.contact.clearance; // wider leaves all of it
    collision::for_each_close_triangle(
        rods.walls[instrument.lumen].tree, wall, middle, across,
        [&](Index, const PointOnTriangle& on) {
            if (nearest.normal.dot(middle - on.point) < 0.0) across = std::min(across, std::sqrt(on.distance_sq));
        });
    return std::min(model.contact.clearance, 0.5 * std::max(0.0, 0.5 * (room + across) - radius));
}

/// Is the wall nearer to p than `radius`, or p up to `reach` behind it? Beside an edge the side is that of one of its faces: good enough to
/// ask for the exact stage, not to replace it.
bool wall_is_near(const SceneModel& model, std::size_t body, const State& state, RodsScratch& rods, const Vec3& p, double radius,
                  double reach) {
    const collision::SurfaceMotion wall = wall_motion(model, body, state, rods);
    double nearest = reach;
    bool behind = false;
    collision::for_each_close_triangle(
        rods.walls[body].tree, wall, p, reach,
        [&](Index id, const PointOnTriangle& on) {
            const double distance = std::sqrt(on.distance_sq);
            if (distance >= nearest) return;
            nearest = distance;
            const Triangle& t = wall.topology->triangles[id];
            behind = twice_area(t, wall.t1).dot(p - on.point) > 0.0;
        });
    return behind || nearest < radius;
}

} // namespace

Index first_walled_node(const SceneModel& model, std::size_t index, const RodsScratch& rods) {
    const fem::RodModel& rod = model.instruments[index].rod;
    const double insertion = rods.instruments[index].command.insertion;
    Index first = fem::first_inserted_node(rod, insertion);
    if (model.instruments[index].inside) // what is in the bore meets no wall
        first = std::max(first, fem::first_free_node(rod, insertion, rods.instruments[*model.instruments[index].inside].command.insertion));
    return first > 0 ? first - 1 : 0;
}

/// The planes of places that are not made anew go on, in the order of their places; those of corrections, at the end, belong to such places as well.
class CarriedPlanes {
public:
    explicit CarriedPlanes(const InstrumentScratch& scratch) noexcept : planes_(scratch.carried_planes), presses_(scratch.carried_presses) {
        while (sorted_ < planes_.size() && (sorted_ == 0 || !(place_of(sorted_) < place_of(sorted_ - 1)))) ++sorted_;
    }
    void take(Index node, double weight, InstrumentState& now) {
        while (at_ < sorted_ && place_of(at_) < std::pair(node, weight)) ++at_;
        for (; at_ < sorted_ && place_of(at_) == std::pair(node, weight); ++at_) add(at_, now);
    }
    /// fresh   [2 node_count]
    void take_rest(std::span<const std::uint8_t> fresh, InstrumentState& now) {
        for (std::size_t k = sorted_; k < planes_.size(); ++k)
            if (fresh[slot_of(planes_[k].node, planes_[k].weight)] == 0) add(k, now);
    }

private:
    [[nodiscard]] std::pair<Index, double> place_of(std::size_t k) const noexcept { return {planes_[k].node, planes_[k].weight}; }
    void add(std::size_t k, InstrumentState& now) const {
        now.planes.push_back(planes_[k]); // reserved
        now.presses.push_back(presses_[k]);
    }
    std::span<const fem::RodPlane> planes_;
    std::span<const WallPress> presses_;
    std::size_t sorted_ = 0, at_ = 0;
};

std::size_t plane_from_wall(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, double reach, bool partly) {
    const InstrumentModel& instrument = model.instruments[index];
    InstrumentState& own = state.instruments[index];
    InstrumentScratch& scratch = rods.instruments[index];
    const collision::SurfaceMotion start = wall_before(model, instrument.lumen, state, rods), whole = wall_motion(model, instrument.lumen, state, rods);
    const collision::SurfaceMotion before = partly ? collision::SurfaceMotion{whole.topology, whole.t1, whole.t1} : start;
    const std::span<const Vec3> after = state.bodies[instrument.lumen].surface;
    collision::DopTree& tree = rods.walls[instrument.lumen].tree;
    const double room = instrument.rod.design.radius + model.contact.clearance;
    const Index nodes = static_cast<Index>(instrument.rod.node_count());
    const collision::SurfaceMotion motion = wall_motion(model, instrument.lumen, state, rods);
    if (partly) scratch.carried_planes = own.planes, scratch.carried_presses = own.presses; // reserved
    CarriedPlanes carried(scratch);
    LastPlanes last(partly ? scratch.carried_planes : scratch.last_planes, partly ? scratch.carried_presses : scratch.last_presses, scratch.pushes, motion,
                    scratch.taken);
    Yielding yielding(model, index, state, rods);
    own.planes.clear();
    own.presses.clear();
    scratch.wall_distance.assign(2 * std::size_t{nodes}, -1.0);
    NearList list;
    double nearest = 0.0;
    const double farthest = room + reach, wall_way = (model.bodies[instrument.lumen].moves() ? rods.walls[instrument.lumen].way : 0.0) + kRounding;
    std::size_t made = 0;
    const std::vector<Vec3>& from = partly ? own.rod.position : scratch.rod_t0.position;
    for (Index node = first_walled_node(model, index, rods); node + 1 < nodes; ++node) {
        yielding.come_to(node);
        for (const double weight : {0.5, 1.0}) {
            if (partly && scratch.fresh[slot_of(node, weight)] == 0) {
                carried.take(node, weight, own);
                continue;
            }
            if (!partly && proven_free(model, index, node, weight, rods)) continue;
            ++made;
            const Vec3 p = (1.0 - weight) * from[node] + weight * from[node + 1];
            list.clear();
            bool behind = false;
            Index nearest_id = kNoIndex; // of equally near ones the lowest: whatever the tree's bounds
            nearest = farthest;
            collision::for_each_close_triangle(tree, before, p, farthest, [&](Index id, const PointOnTriangle& on) {
                const double distance = std::sqrt(on.distance_sq);
                if (distance < nearest || (distance == nearest && id < nearest_id)) {
                    nearest = distance, nearest_id = id;
                    if (partly) behind = twice_area(before.topology->triangles[id], before.t1).dot(p - on.point) > 0.0;
                }
                if (!(distance > 0.0)) return farthest;
                // Its side is that of the start of the step: a wall that has swept past the rod since then takes it along.
                const Vec3 now = point_on(before.topology->triangles[id], on.bary, after);
                const Vec3 normal = (p - on.point) / distance;
                const Vec3 was = partly ? point_on(before.topology->triangles[id], on.bary, start.t1) : on.point;
                list.add({id, normal.dot(p - now), normal, on.point, now, (now - was) / model.step_s, on.bary});
                return list.full_within() + wall_way; // no farther one can be in it
            });
            const double kept = instrument.rod.design.radius + find_clearance(model, index, list, p, before, rods);
            add_planes(list, {node, weight, p, kept, farthest, before, instrument.rod.friction_at(node, weight)}, last, own, &yielding);
            scratch.wall_distance[slot_of(node, weight)] = behind ? 0.0 : nearest;
        }
    }
    if (partly) carried.take_rest(scratch.fresh, own);
    return made;
}

bool has_swept_into_wall(const SceneModel& model, std::size_t index, double way, double depth, const State& state, RodsScratch& rods) {
    const std::vector<Vec3>&from = rods.instruments[index].rod_t0.position, &to = state.instruments[index].rod.position;
    const double radius = model.instruments[index].rod.design.radius;
    for (Index node = first_walled_node(model, index, rods); node + 1 < to.size(); ++node)
        for (const double weight : {0.5, 1.0}) {
            const Vec3 p = (1.0 - weight) * from[node] + weight * from[node + 1], q = (1.0 - weight) * to[node] + weight * to[node + 1];
            const double came = std::sqrt((q - p).squaredNorm());
            if (came > way && wall_is_near(model, model.instruments[index].lumen, state, rods, q, radius - depth, radius + came)) return true;
        }
    return false;
}

std::size_t plane_from_walls(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, double reach) {
    std::size_t made = 0;
    for (const std::size_t one : solved_with(model, rods, index)) made += plane_from_wall(model, one, state, rods, reach);
    return made;
}

/// m, of the walls of all that is solved with it.
static double way_of_walls(const SceneModel& model, std::size_t index, const RodsScratch& rods) {
    double way = 0.0;
    for (const std::size_t one : solved_with(model, rods, index)) {
        const std::size_t lumen = model.instruments[one].lumen;
        if (model.bodies[lumen].moves()) way = std::max(way, rods.walls[lumen].way);
    }
    return way;
}

double longest_approach(const SceneModel& model, std::size_t index, const State& state, const RodsScratch& rods) {
    double longest = 0.0;
    for (const std::size_t one : solved_with(model, rods, index))
        longest = std::max(longest, longest_way(rods.instruments[one].rod_t0.position, state.instruments[one].rod.position));
    return longest + way_of_walls(model, index, rods);
}

double farthest_reach(const SceneModel& model, std::size_t index, const RodsScratch& rods) {
    return kPlaneReach + way_of_walls(model, index, rods);
}

bool solve_left_reach(const SceneModel& model, std::size_t index, double reach, const State& state, const RodsScratch& rods) {
    if (!(reach < farthest_reach(model, index, rods))) return false;
    double farthest = 0.0; // in an iteration: it may overshoot what the solve ends with by far
    for (const std::size_t one : solved_with(model, rods, index)) farthest = std::max(farthest, rods.instruments[one].rod_report.farthest_m);
    farthest += way_of_walls(model, index, rods);
    return std::max(farthest, longest_approach(model, index, state, rods)) > reach;
}

double suggest_plane_reach(const SceneModel& model, std::size_t index, const State& state, const RodsScratch& rods) {
    return std::min(farthest_reach(model, index, rods), kSwing * longest_approach(model, index, state, rods) + kLeastSwing);
}

/// N s/m^2, across the axis.
static constexpr double kThicker[] = {10.0, 100.0, 1000.0, 10000.0};

/// Has a place gone farther than the planes reach, and so far that it may have met its wall?
static bool may_have_met_unknown(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    const std::vector<Vec3>&from = rods.instruments[index].rod_t0.position, &to = state.instruments[index].rod.position;
    WallScratch& wall = rods.walls[instrument.lumen];
    const collision::SurfaceMotion before = wall_before(model, instrument.lumen, state, rods);
    const double room = instrument.rod.design.radius + model.contact.clearance;
    const double wall_way = model.bodies[instrument.lumen].moves() ? wall.way : 0.0;
    const Index first = fem::first_inserted_node(instrument.rod, state.instruments[index].rod.insertion);
    for (Index node = first > 0 ? first - 1 : 0; node + 1 < to.size(); ++node)
        for (const double weight : {0.5, 1.0}) {
            const Vec3 p = (1.0 - weight) * from[node] + weight * from[node + 1], q = (1.0 - weight) * to[node] + weight * to[node + 1];
            const double way = std::sqrt((q - p).squaredNorm());
            if (way <= kPlaneReach) continue;
            bool near = false;
            collision::for_each_close_triangle(
                wall.tree, before, p, room + way + wall_way, [&](Index, const PointOnTriangle&) { near = true; });
            if (near) return true;
        }
    return false;
}

void keep_within_reach(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods) {
    for (const double thicker : kThicker) {
        bool within = true;
        for (const std::size_t one : solved_with(model, rods, index)) within = within && !may_have_met_unknown(model, one, state, rods);
        if (within) return;
        for (const std::size_t one : solved_with(model, rods, index)) {
            InstrumentScratch& own = rods.instruments[one];
            own.slowed = true;
            own.thicker.design.transverse_drag = std::max(thicker, model.instruments[one].rod.design.transverse_drag);
        }
        solve_instrument(model, index, state, rods);
    }
}

void solve_between_walls(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, StepBudget& budget) {
    for (double reach = suggest_plane_reach(model, index, state, rods);; reach = farthest_reach(model, index, rods)) {
        Phase phase(budget, StepPart::Planes);
        const std::size_t made = plane_from_walls(model, index, state, rods, reach);
        phase.end();
        budget.learn_places(StepPart::Planes, made);
        budget.begin_solve();
        solve_instrument(model, index, state, rods);
        budget.end_solve();
        if (solve_left_reach(model, index, reach, state, rods)) continue;
        keep_within_reach(model, index, state, rods);
        return;
    }
}

/// Was the wall so far from this place at the step's start that it cannot have come within `reach` since?
static bool stayed_away(const SceneModel& model, std::size_t index, Index node, double weight, const Vec3& place, double reach,
                        const RodsScratch& rods) {
    const InstrumentScratch& scratch = rods.instruments[index];
    if (scratch.wall_distance.empty()) return false; // nobody has looked
    const double before = scratch.wall_distance[slot_of(node, weight)];
    const Vec3 from = (1.0 - weight) * scratch.rod_t0.position[node] + weight * scratch.rod_t0.position[node + 1];
    const BodyModel& wall = model.bodies[model.instruments[index].lumen];
    const double wall_way = wall.moves() ? rods.walls[model.instruments[index].lumen].way : 0.0;
    return before - wall_way - std::sqrt((place - from).squaredNorm()) > reach * (1.0 + 0x1p-40);
}

static bool rod_penetrates_wall(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    const fem::RodState& rod = state.instruments[index].rod;
    const double radius = instrument.rod.design.radius;
    // From within, what passes through the wall comes nearer to it than the radius on its way, unless it is faster than that.
    const bool near_first = state.instruments[index].kept_inside && longest_approach(model, index, state, rods) < radius;
    const double reach = near_first ? radius : radius + kPlaneReach;
    const Index first = fem::first_inserted_node(instrument.rod, rod.insertion);
    for (Index node = first > 0 ? first - 1 : 0; node + 1 < rod.position.size(); ++node)
        for (const double weight : {0.5, 1.0}) {
            const Vec3 p = (1.0 - weight) * rod.position[node] + weight * rod.position[node + 1];
            if (stayed_away(model, index, node, weight, p, reach, rods)) continue;
            if (still_proven_free(model, index, node, weight, p, rods)) continue;
            if (wall_is_near(model, instrument.lumen, state, rods, p, radius, reach)) return true;
        }
    return false;
}

/// Planes of one rod's wall by where the last solve has left the rod.
static void plane_where_it_stands(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    InstrumentState& own = state.instruments[index];
    const collision::SurfaceMotion wall = wall_motion(model, instrument.lumen, state, rods);
    const double room = instrument.rod.design.radius + model.contact.clearance;
    const Index first = fem::first_inserted_node(instrument.rod, own.rod.insertion);
    LastPlanes none({}, {}, {}, wall, rods.instruments[index].taken);
    NearList list;
    for (Index node = first > 0 ? first - 1 : 0; node + 1 < own.rod.position.size(); ++node)
        for (const double weight : {0.5, 1.0}) {
            if (own.planes.size() + kPlanesPerPlace > own.planes.capacity()) return; // reserved
            const Vec3 p = (1.0 - weight) * own.rod.position[node] + weight * own.rod.position[node + 1];
            if (stayed_away(model, index, node, weight, p, room, rods) || still_proven_free(model, index, node, weight, p, rods)) continue;
            list.clear();
            collision::for_each_close_triangle(rods.walls[instrument.lumen].tree, wall, p, room, [&](Index id, const PointOnTriangle& on) {
                const double distance = std::sqrt(on.distance_sq);
                if (!(distance > 0.0)) return room;
                const Triangle& t = wall.topology->triangles[id];
                const Vec3 moved = on.point - point_on(t, on.bary, wall.t0), towards = (p - on.point) / distance;
                const double facing = spheretree::direction_of(twice_area(t, wall.t1)).dot(towards);
                list.add({id, distance, towards, on.point, on.point, moved / model.step_s, on.bary, facing});
                return list.full_within() + kRounding;
            });
            list.turn_inwards();
            const double kept = instrument.rod.design.radius + find_clearance(model, index, list, p, wall, rods);
            add_planes(list, {node, weight, p, kept, kept, wall, instrument.rod.friction_at(node, weight)}, none, own, nullptr);
        }
}

void solve_where_it_stands(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, StepBudget& budget) {
    Phase phase(budget, StepPart::Planes);
    for (const std::size_t one : solved_with(model, rods, index)) plane_where_it_stands(model, one, state, rods);
    phase.end();
    budget.begin_solve();
    solve_instrument(model, index, state, rods);
    budget.end_solve();
}

bool penetrates_wall(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods) {
    for (const std::size_t one : solved_with(model, rods, index))
        if (rod_penetrates_wall(model, one, state, rods)) return true;
    return false;
}

} // namespace trocar::engine
