#include "engine/step/instrument/wall_facets.hpp"
#include "engine/step/tissue/surface_place.hpp"

#include <limits>
#include <utility>

namespace trocar::engine {

namespace {

/// So many planes of a place look the same way, by the cosine between them: six close in from all sides, three are a corner of facets. Tissue may
/// fold up around what presses into it: every facet of it near the rod gets its plane.
struct Spread {
    double cosine;
    std::size_t most;
    double within = std::numeric_limits<double>::infinity(); // of what the place keeps: facets farther away are left out
    bool of_tissue = false;                                  // of walls that yield alone
};
constexpr Spread kSpreads[] = {{0.5, 1}, {0.9, 3}, {0.995, kPlanesPerPlace, 2.0, true}};
/// Cosine above which they are the same plane: of what has gone out over an edge the triangles beside it are the same way off.
constexpr double kSamePlane = 1.0 - 1e-6;
/// m; what stands out of a plane by less adds nothing to it.
constexpr double kFlat = 1e-6;
constexpr std::size_t kFacets = 24;

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
    for (std::size_t k = 0; k < list.size(); ++k) {
        const NearTriangle& near = list[k];
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

} // namespace

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

} // namespace trocar::engine
