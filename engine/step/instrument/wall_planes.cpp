// Planes around a rod from its wall's own triangles, and whether a rod pokes into that wall.
#include "collision/proximity/proximity.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/instrument/wall_exchange.hpp"
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
/// Cosine above which a new plane goes on with the forces of a last one.
constexpr double kSameDirection = 0.9;
/// So many planes of a place look the same way, by the cosine between them: six close in from all sides, three are a corner of facets. Tissue may
/// fold up around what presses into it: every facet of it near the rod gets its plane.
struct Spread {
    double cosine;
    std::size_t most;
    double within = std::numeric_limits<double>::infinity(); // of what the place keeps: facets farther away are left out
    bool of_tissue = false;                                  // of walls that yield alone
};
constexpr Spread kSpreads[] = {{0.5, 1}, {0.9, 3}, {0.995, kPlanesPerPlace, 2.0, true}};
/// Cosine; where what is near looks farther aside than this of the nearest, the lumen may be narrow.
constexpr double kSideways = 0.5;
/// Cosine above which they are the same plane: of what has gone out over an edge the triangles beside it are the same way off.
constexpr double kSamePlane = 1.0 - 1e-6;
/// m; what stands out of a plane by less adds nothing to it.
constexpr double kFlat = 1e-6;
/// m; nearest points of triangles that are one point of the edge or corner that they share.
constexpr double kSamePoint = 1e-12;
constexpr std::size_t kNearTriangles = 64, kFacets = 24;
struct NearTriangle {
    Index triangle;
    double distance; // m, signed, of the rod where it was from the wall where it will be
    Vec3 normal;
    Vec3 seen;     // m, of the wall where it was found
    Vec3 point;    // m, of the wall at t1
    Vec3 velocity; // m/s
    std::array<double, 3> bary;
    double facing = 0.0; // cosine between its outward normal and the way from it to the place
};

/// The nearest triangles of one place, nearest first; a longer list than kNearTriangles drops its farthest.
class NearList {
public:
    void clear() noexcept { size_ = 0; }
    void add(const NearTriangle& entry) noexcept {
        std::size_t at = size_;
        while (at > 0 && before(entry, entries_[at - 1])) --at;
        if (at >= kNearTriangles) return;
        const std::size_t kept = std::min(size_, kNearTriangles - 1);
        for (std::size_t i = kept; i > at; --i) entries_[i] = entries_[i - 1];
        entries_[at] = entry;
        size_ = kept + 1;
    }
    [[nodiscard]] std::span<const NearTriangle> entries() const noexcept { return {entries_.data(), size_}; }

    /// Normals away from the wall become such that look into the lumen: what has gone out is brought back. On which side of an edge or a
    /// corner a place is the face says that looks at it most; the others beside it may look away.
    void turn_inwards() noexcept {
        std::array<double, kNearTriangles> facing;
        for (std::size_t i = 0; i < size_; ++i) {
            facing[i] = entries_[i].facing;
            for (std::size_t k = 0; k < size_; ++k)
                if ((entries_[k].seen - entries_[i].seen).squaredNorm() < kSamePoint * kSamePoint && std::abs(entries_[k].facing) > std::abs(facing[i]))
                    facing[i] = entries_[k].facing;
        }
        for (std::size_t i = 0; i < size_; ++i)
            if (facing[i] > 0.0) entries_[i].normal = -entries_[i].normal;
    }

private:
    static bool before(const NearTriangle& a, const NearTriangle& b) noexcept {
        return a.distance < b.distance || (a.distance == b.distance && a.triangle < b.triangle);
    }
    std::array<NearTriangle, kNearTriangles> entries_;
    std::size_t size_ = 0;
};

/// The wall where it stood at the start of the step: what the rod was inside of.
collision::SurfaceMotion wall_before(const SceneModel& model, std::size_t body, const State& state, const RodsScratch& rods) {
    const collision::SurfaceMotion motion = wall_motion(model, body, state, rods);
    return {motion.topology, motion.t0, motion.t0};
}

/// The last step's planes, in the order of their places: warm start of the new ones.
class LastPlanes {
public:
    /// wall   whose motion of the step the tissue has felt the pushes over; `pushes` empty: a wall that no force moves in this step
    LastPlanes(std::span<const fem::RodPlane> planes, std::span<const WallPress> presses, std::span<const WallPush> pushes,
               const collision::SurfaceMotion& wall, std::vector<std::uint8_t>& taken) noexcept
        : planes_(planes), presses_(presses), pushes_(pushes), wall_(wall), taken_(taken) {
        taken_.assign(planes_.size(), 0); // reserved
    }

    /// Those at a place of the rod; places are asked for in ascending order.
    void seek(Index node, double weight) noexcept {
        node_ = node, weight_ = weight;
        while (at_ < planes_.size() && before(planes_[at_], node, weight)) ++at_;
        while (push_at_ < pushes_.size() && before(pushes_[push_at_], node, weight)) ++push_at_;
        end_ = at_;
        while (end_ < planes_.size() && planes_[end_].node == node && planes_[end_].weight == weight) ++end_;
    }
    /// Forces of the one that pushed most nearly along the new one's normal; each is given once.
    void warm_start(fem::RodPlane& plane) noexcept {
        std::size_t best = end_;
        double nearest = kSameDirection;
        for (std::size_t k = at_; k < end_; ++k)
            if (const double along = planes_[k].normal.dot(plane.normal); taken_[k] == 0 && planes_[k].force > 0.0 && along > nearest)
                nearest = along, best = k;
        if (best == end_) return;
        taken_[best] = 1;
        plane.start_force = planes_[best].force;
        plane.start_drag = planes_[best].drag;
    }
    /// What the tissue felt at the place at the step's end, as the rod does. visit(N)
    template <class Visit>
    void for_each_felt(Visit&& visit) const {
        for (std::size_t k = push_at_; k < pushes_.size() && pushes_[k].node == node_ && pushes_[k].weight == weight_; ++k)
            visit(felt_of(pushes_[k], way_of(pushes_[k], wall_)));
    }

private:
    template <class AtPlace>
    static bool before(const AtPlace& what, Index node, double weight) noexcept {
        return what.node < node || (what.node == node && what.weight < weight);
    }
    std::span<const fem::RodPlane> planes_;
    std::span<const WallPress> presses_;
    std::span<const WallPush> pushes_;
    const collision::SurfaceMotion& wall_;
    std::vector<std::uint8_t>& taken_;
    std::size_t at_ = 0, end_ = 0, push_at_ = 0;
    Index node_ = 0;
    double weight_ = 0.0;
};

/// By how much a wall gives way to a rod, and which of the two is softer.
class Yielding {
public:
    Yielding(const SceneModel& model, std::size_t index, const State& state, const RodsScratch& rods) noexcept
        : model_(model), index_(index), state_(state), rods_(rods) {}

    [[nodiscard]] bool is_tissue() const noexcept { return rods_.tissue_moves && model_.bodies[lumen()].host_body; }
    /// Nodes in ascending order, from the first that may press on.
    void come_to(Index node) noexcept {
        const std::vector<Vec3>& position = rods_.instruments[index_].rod_t0.position;
        rod_ += 1.0 / model_.instruments[index_].rod.stretch_stiffness[node];
        axis_ = spheretree::direction_of(position[node + 1] - position[node]);
    }
    /// m/N; where nothing pressed yet.
    [[nodiscard]] double before_force(const WallPress& press) const noexcept { return find_wall_give(model_, lumen(), press, rods_); }
    [[nodiscard]] double along(const WallPress& press, const Vec3& normal) const {
        return find_exact_give(model_, lumen(), press, normal, state_, rods_);
    }
    /// Of the rod counts its length from the handle: across its axis it bends.
    [[nodiscard]] bool is_softer(const Vec3& normal, double give) const noexcept {
        const double along = normal.dot(axis_);
        return along * along * give > rod_;
    }

private:
    [[nodiscard]] std::size_t lumen() const noexcept { return model_.instruments[index_].lumen; }
    const SceneModel& model_;
    std::size_t index_;
    const State& state_;
    const RodsScratch& rods_;
    double rod_ = 0.0; // m/N
    Vec3 axis_ = Vec3::Zero();
};

/// A place of a rod for which planes are made, and the wall as it is seen from there.
struct PlaneSite {
    Index node;
    double weight;
    Vec3 place; // m
    double room;     // m, that it keeps
    double farthest; // m; what is farther away gets no plane
    const collision::SurfaceMotion& wall; // at t1
    double friction = 1.0; // [-] of the instrument's
};

/// How far a triangle stands out of the plane through another's nearest point, m: what is not in front of a plane that holds is not met.
double stands_out(const NearTriangle& near, const NearTriangle& plane, const PlaneSite& site) noexcept {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Index v : site.wall.topology->triangles[near.triangle])
        farthest = std::max(farthest, plane.normal.dot(site.wall.t1[v] - plane.seen));
    return farthest;
}

/// The plane that keeps a place from a triangle. Where the nearest point is on its border and the place lies well before its face, the
/// face: seen from within a valley of the wall, a plane through the border would lean over what is free.
Vec3 plane_normal(const NearTriangle& near, const PlaneSite& site) {
    if (std::min({near.bary[0], near.bary[1], near.bary[2]}) > 0.0) return near.normal;
    const Vec3 face = spheretree::direction_of(twice_area(site.wall.topology->triangles[near.triangle], site.wall.t1));
    const double before = face.dot(site.place - near.seen);
    return std::abs(before) < site.room ? near.normal : before > 0.0 ? face : Vec3(-face);
}

/// Of the list, nearest first, what stands out of all that is nearer, with the normals of their planes.
std::span<const NearTriangle> facets_of(const NearList& list, const PlaneSite& site, std::array<NearTriangle, kFacets>& facets) {
    std::size_t count = 0;
    for (const NearTriangle& near : list.entries()) {
        const bool known = std::any_of(facets.begin(), facets.begin() + static_cast<std::ptrdiff_t>(count), [&](const NearTriangle& plane) {
            return plane.normal.dot(near.normal) > kSamePlane || !(stands_out(near, plane, site) > kFlat);
        });
        if (known) continue;
        facets[count] = near;
        facets[count].normal = plane_normal(near, site);
        if (++count == kFacets) break;
    }
    return std::span(facets).first(count);
}

/// The facets of a place that get planes: what closes in from all sides first, then one by one, nearest first each time.
struct ChosenFacets {
    ChosenFacets(std::span<const NearTriangle> facets, const PlaneSite& site, bool is_tissue) noexcept {
        for (const Spread& spread : kSpreads)
            for (const NearTriangle& facet : facets)
                if ((is_tissue || !spread.of_tissue) && facet.distance < spread.within * site.room) offer(facet, spread);
    }
    void offer(const NearTriangle& facet, const Spread& spread) noexcept {
        if (count == kPlanesPerPlace) return;
        std::size_t alike = 0;
        for (std::size_t k = 0; k < count; ++k) {
            if (made[k] == &facet) return;
            alike += made[k]->normal.dot(facet.normal) > spread.cosine;
        }
        if (alike < spread.most) made[count++] = &facet;
    }
    std::array<const NearTriangle*, kPlanesPerPlace> made;
    std::size_t count = 0;
};

/// What the tissue felt of the last planes of a place, each of their sides, hardest first, N.
struct FeltSides {
    void add(const Vec3& one) noexcept {
        if (count == felt.size() || one.isZero(0.0)) return;
        std::size_t at = count++;
        for (; at > 0 && felt[at - 1].squaredNorm() < one.squaredNorm(); --at) felt[at] = felt[at - 1];
        felt[at] = one;
    }
    std::array<Vec3, kPlanesPerPlace> felt;
    std::size_t count = 0;
};

/// Planes of the facets that look along an axis; without one, as the first that is left does. They leave the list.
/// Returns how many left it.
std::size_t add_side(const Vec3* axis, std::span<const NearTriangle*> facets, const PlaneSite& site, std::uint8_t side, LastPlanes& last,
                     InstrumentState& now, const Yielding* yielding) {
    std::size_t left = 0;
    double give = 0.0; // of the nearest, for all of the side
    Vec3 along = axis != nullptr ? *axis : Vec3(Vec3::Zero());
    for (const NearTriangle*& near : facets) {
        if (near == nullptr) continue;
        const bool seeds = axis == nullptr && left == 0;
        if (seeds) along = near->normal;
        if (!seeds && !(near->normal.dot(along) > 0.0)) continue;
        const NearTriangle& plane = *std::exchange(near, nullptr);
        if (left++ == 0 && yielding != nullptr) give = yielding->before_force({plane.triangle, plane.bary});
        if (plane.distance > site.farthest) continue;
        now.planes.push_back({site.node, site.weight, plane.normal, plane.normal.dot(plane.point) + site.room, 0.0, plane.velocity});
        now.planes.back().friction_share = site.friction;
        now.presses.push_back({plane.triangle, plane.bary, give});
        last.warm_start(now.planes.back());
        now.planes.back().side = side;
    }
    return left;
}

/// Planes of one place. What looks along the force that the tissue felt last is one side, and moves as one: facets that press in a fold stay
/// together, whichever of them is nearest. The others are sides as they look the same way.
/// yielding   null: the wall does not
void add_planes(const NearList& list, const PlaneSite& site, LastPlanes& last, InstrumentState& now, const Yielding* yielding) {
    std::array<NearTriangle, kFacets> memory;
    ChosenFacets facets(facets_of(list, site, memory), site, yielding != nullptr && yielding->is_tissue());
    last.seek(site.node, site.weight);
    FeltSides sides;
    if (yielding != nullptr) last.for_each_felt([&](const Vec3& felt) { sides.add(felt); });
    const auto chosen = std::span(facets.made).first(facets.count);
    std::size_t left = facets.count;
    std::uint8_t side = 0;
    for (std::size_t turn = 0; left > 0; ++turn) {
        const std::size_t first = now.planes.size();
        const Vec3* felt = turn < sides.count ? &sides.felt[turn] : nullptr;
        const std::size_t taken = add_side(felt, chosen, site, side, last, now, yielding);
        left -= taken;
        side = static_cast<std::uint8_t>(side + (taken > 0));
        if (first == now.planes.size() || yielding == nullptr) continue;
        if (felt != nullptr) {
            const double give = yielding->along(now.presses[first], now.planes[first].normal);
            for (std::size_t k = first; k < now.planes.size(); ++k) now.planes[k].felt = *felt, now.presses[k].give = give;
        }
        bool is_softer = false;
        for (std::size_t k = first; k < now.planes.size(); ++k) is_softer = is_softer || yielding->is_softer(now.planes[k].normal, now.presses[k].give);
        for (std::size_t k = first; is_softer && k < now.planes.size(); ++k) now.planes[k].give = now.presses[k].give;
    }
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
    if (list.entries().empty()) return model.contact.clearance;
    const NearTriangle& nearest = list.entries().front();
    if (std::ranges::none_of(list.entries(), [&](const NearTriangle& near) { return near.normal.dot(nearest.normal) < kSideways; }))
        return model.contact.clearance;
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
    if (is_coaxial_inner(model, index)) // what is in the bore meets no wall
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
            nearest = room + reach;
            collision::for_each_close_triangle(
                tree, before, p, room + reach,
                [&](Index id, const PointOnTriangle& on) {
                    const double distance = std::sqrt(on.distance_sq);
                    if (partly && distance < nearest) behind = twice_area(before.topology->triangles[id], before.t1).dot(p - on.point) > 0.0;
                    nearest = std::min(nearest, distance);
                    if (!(distance > 0.0)) return;
                    // Its side is that of the start of the step: a wall that has swept past the rod since then takes it along.
                    const Vec3 now = point_on(before.topology->triangles[id], on.bary, after);
                    const Vec3 normal = (p - on.point) / distance;
                    const Vec3 was = partly ? point_on(before.topology->triangles[id], on.bary, start.t1) : on.point;
                    list.add({id, normal.dot(p - now), normal, on.point, now, (now - was) / model.step_s, on.bary});
                });
            const double kept = instrument.rod.design.radius + find_clearance(model, index, list, p, before, rods);
            add_planes(list, {node, weight, p, kept, room + reach, before, instrument.rod.friction_at(node, weight)}, last, own, &yielding);
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

double longest_approach(const SceneModel& model, std::size_t index, const State& state, const RodsScratch& rods) {
    const BodyModel& wall = model.bodies[model.instruments[index].lumen];
    double longest = 0.0;
    for (const std::size_t one : solved_with(model, rods, index))
        longest = std::max(longest, longest_way(rods.instruments[one].rod_t0.position, state.instruments[one].rod.position));
    return longest + (wall.moves() ? rods.walls[model.instruments[index].lumen].way : 0.0);
}

/// m; kPlaneReach, and the way that the wall itself comes.
static double farthest_reach(const SceneModel& model, std::size_t index, const RodsScratch& rods) {
    const std::size_t lumen = model.instruments[index].lumen;
    return kPlaneReach + (model.bodies[lumen].moves() ? rods.walls[lumen].way : 0.0);
}

bool solve_left_reach(const SceneModel& model, std::size_t index, double reach, const State& state, const RodsScratch& rods) {
    if (!(reach < farthest_reach(model, index, rods))) return false;
    const BodyModel& wall = model.bodies[model.instruments[index].lumen];
    double farthest = 0.0; // in an iteration: it may overshoot what the solve ends with by far
    for (const std::size_t one : solved_with(model, rods, index)) farthest = std::max(farthest, rods.instruments[one].rod_report.farthest_m);
    if (wall.moves()) farthest += rods.walls[model.instruments[index].lumen].way;
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
            collision::for_each_close_triangle(
                rods.walls[instrument.lumen].tree, wall, p, room,
                [&](Index id, const PointOnTriangle& on) {
                    const double distance = std::sqrt(on.distance_sq);
                    if (!(distance > 0.0)) return;
                    const Triangle& t = wall.topology->triangles[id];
                    const Vec3 moved = on.point - point_on(t, on.bary, wall.t0), towards = (p - on.point) / distance;
                    const double facing = spheretree::direction_of(twice_area(t, wall.t1)).dot(towards);
                    list.add({id, distance, towards, on.point, on.point, moved / model.step_s, on.bary, facing});
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
