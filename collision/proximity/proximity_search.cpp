#include "collision/proximity/proximity_search.hpp"

#include "collision/culling/chromatic_sets.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trocar::collision {
namespace {

/// Squares and products of coordinates up to this stay finite, and single precision holds it.
constexpr double kLargestInput = 1e30; // m

std::uint64_t mix(std::uint64_t z) noexcept { // splitmix64
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}

/// Of the triangles, in their order.
std::uint64_t fingerprint_of(const SurfaceTopology& topology) noexcept {
    std::uint64_t sum = topology.vertex_count(), place = 0;
    for (const Triangle& t : topology.triangles) {
        place += 0x9e3779b97f4a7c15ull;
        sum += mix(mix(place + (std::uint64_t{t[0]} << 32 | t[1])) + t[2]);
    }
    return sum;
}

std::string name_of(std::size_t body) { return "body " + std::to_string(body); }

Result<void> check_positions(std::size_t body, std::span<const Vec3> positions, const char* when) {
    for (std::size_t v = 0; v < positions.size(); ++v)
        for (int axis = 0; axis < 3; ++axis)
            if (!(std::abs(positions[v][axis]) <= kLargestInput))
                return Error{.code = ErrorCode::NotFinite,
                             .message = name_of(body) + ", vertex " + std::to_string(v) + ", " + "xyz"[axis] + " " + when + " is " +
                                        std::to_string(positions[v][axis]) + ": a finite coordinate of at most 1e30 m is needed"};
    return {};
}

double largest_of(const SurfaceMotion& motion) noexcept {
    double largest = 0.0;
    for (const auto& positions : {motion.t0, motion.t1})
        for (const Vec3& p : positions) largest = std::max(largest, p.lpNorm<Eigen::Infinity>());
    return largest;
}

bool tests_itself(const ProximityOptions& options, std::size_t body) noexcept {
    return (options.within >> std::min<std::size_t>(body, 63) & 1u) != 0;
}

bool comes_before(const Proximity& x, const Proximity& y) noexcept {
    return x.face_a != y.face_a ? x.face_a < y.face_a : x.face_b < y.face_b;
}

} // namespace

Result<void> ProximitySearch::build(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
                                    const ProximityOptions& options) {
    assert(surfaces.size() == positions.size() && surfaces.size() <= 65536);
    if (auto checked = check_options(options); !checked) return checked;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        if (positions[i].size() != surfaces[i]->vertex_count())
            return Error{.message = name_of(i) + " has " + std::to_string(positions[i].size()) + " positions for " +
                                    std::to_string(surfaces[i]->vertex_count()) + " vertices"};
        if (auto checked = check_positions(i, positions[i], "of the shape"); !checked) return checked;
        for (const Triangle& t : surfaces[i]->triangles)
            for (const Index v : t)
                if (v >= positions[i].size())
                    return Error{.code = ErrorCode::BadMesh,
                                 .message = name_of(i) + " has a face with vertex " + std::to_string(v) + " of " +
                                            std::to_string(positions[i].size())};
    }
    *this = ProximitySearch();
    options_ = options;
    trees_.resize(surfaces.size());
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        trees_[i].build(*surfaces[i], positions[i], options, tests_itself(options, i));
        fingerprints_.push_back(fingerprint_of(*surfaces[i]));
        expected_.emplace_back();
        if (options.coherence == Coherence::VelocityCones) expected_.back().resize(positions[i].size());
    }
    sides_.resize(surfaces.size());
    largest_.assign(surfaces.size(), 0.0);
    for (std::size_t a = 0; a < surfaces.size(); ++a)
        for (std::size_t b = a; b < surfaces.size(); ++b)
            if (a == b ? tests_itself(options, a) : options.between) {
                jobs_.push_back({static_cast<SurfaceIndex>(a), static_cast<SurfaceIndex>(b), {}});
                jobs_.back().traversal.build(options, options.arity);
            }
    return {};
}

Result<void> ProximitySearch::check_motion(SurfaceIndex surface, const SurfaceMotion& motion) const {
    const SurfaceTopology& topology = trees_[surface].topology();
    if (motion.topology != &topology || fingerprint_of(topology) != fingerprints_[surface])
        return Error{.code = ErrorCode::BadMesh,
                     .message = name_of(surface) + " has another connectivity than the search was built with: build it again"};
    if (motion.t0.size() != topology.vertex_count() || motion.t1.size() != topology.vertex_count())
        return Error{.code = ErrorCode::BadMesh,
                     .message = name_of(surface) + " has " + std::to_string(motion.t0.size()) + " and " + std::to_string(motion.t1.size()) +
                                " positions for " + std::to_string(topology.vertex_count()) + " vertices"};
    if (auto checked = check_positions(surface, motion.t0, "at t0"); !checked) return checked;
    return check_positions(surface, motion.t1, "at t1");
}

Result<void> ProximitySearch::refit(std::span<const SurfaceMotion> motions) {
    if (motions.size() != trees_.size())
        return Error{.code = ErrorCode::BadMesh,
                     .message = std::to_string(motions.size()) + " motions for " + std::to_string(trees_.size()) + " surfaces"};
    ready_ = false;
    for (std::size_t i = 0; i < motions.size(); ++i)
        if (auto checked = check_motion(static_cast<SurfaceIndex>(i), motions[i]); !checked) return checked;
    if (!found_) // a step without a find(): the kept results lack its motion
        for (Job& job : jobs_) job.traversal.forget();
    refit_stats_ = {};
    for (std::size_t i = 0; i < motions.size(); ++i) {
        double strayed_sq = 0.0;
        for (std::size_t v = 0; v < expected_[i].size(); ++v) {
            if (has_expected_) strayed_sq = std::max(strayed_sq, (motions[i].t0[v] - expected_[i][v]).squaredNorm());
            expected_[i][v] = motions[i].t1[v];
        }
        sides_[i] = {static_cast<SurfaceIndex>(i), &trees_[i], motions[i], std::sqrt(strayed_sq) * (1.0 + 1e-12)};
        largest_[i] = largest_of(motions[i]);
        trees_[i].refit(motions[i]);
        const ConeTree::RefitStats& part = trees_[i].refit_stats();
        refit_stats_.vertices += part.vertices;
        refit_stats_.slots += part.slots;
        refit_stats_.velocity_cones += part.velocity_cones;
        refit_stats_.normal_cones += part.normal_cones;
    }
    has_expected_ = true;
    ready_ = true;
    found_ = false;
    return {};
}

void ProximitySearch::find(std::vector<Proximity>& proximities) {
    assert(ready_);
    stats_ = {};
    proximities.clear();
    if (!ready_) return;
    for (Job& job : jobs_) {
        const std::size_t begin = proximities.size();
        job.traversal.find(sides_[job.a], sides_[job.b], std::max(largest_[job.a], largest_[job.b]), proximities);
        std::sort(proximities.begin() + static_cast<std::ptrdiff_t>(begin), proximities.end(), comes_before);
        stats_.add(job.traversal.stats());
    }
    found_ = true;
}

std::size_t ProximitySearch::memory() const noexcept {
    std::size_t bytes = 0;
    for (const ConeTree& tree : trees_) bytes += tree.memory();
    for (const Job& job : jobs_) bytes += job.traversal.memory();
    for (const auto& positions : expected_) bytes += positions.capacity() * sizeof(Vec3);
    return bytes;
}

void find_all_proximities(std::span<const SurfaceMotion> motions, const ProximityOptions& options, std::vector<Proximity>& out) {
    out.clear();
    const auto corners = [](const SurfaceMotion& m, Index face) {
        const Triangle& t = m.topology->triangles[face];
        return SweptFace{{m.t0[t[0]], m.t0[t[1]], m.t0[t[2]]}, {m.t1[t[0]], m.t1[t[1]], m.t1[t[2]]}};
    };
    for (std::size_t a = 0; a < motions.size(); ++a)
        for (std::size_t b = a; b < motions.size(); ++b) {
            if (a == b ? !tests_itself(options, a) : !options.between) continue;
            const auto &faces_a = motions[a].topology->triangles, &faces_b = motions[b].topology->triangles;
            const double distance = a == b ? options.self_distance : options.distance;
            for (Index i = 0; i < faces_a.size(); ++i)
                for (Index k = a == b ? i + 1 : 0; k < faces_b.size(); ++k) {
                    if (a == b && are_adjacent(faces_a[i], faces_b[k])) continue;
                    Proximity near{
                        .surface_a = static_cast<SurfaceIndex>(a), .surface_b = static_cast<SurfaceIndex>(b), .face_a = i, .face_b = k, .found = {}};
                    const SweptFace of_a = corners(motions[a], i), of_b = corners(motions[b], k);
                    if (options.leaf_test == LeafTest::Faces
                            ? find_face_proximity(of_a, of_b, distance, options.during_step, near.found)
                            : find_vertex_proximity(of_a, of_b, distance, options.during_step, a == b, near.found))
                        out.push_back(near);
                }
        }
}

} // namespace trocar::collision
