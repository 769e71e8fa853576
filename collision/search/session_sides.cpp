#include "collision/search/session_sides.hpp"

#include "collision/clones.hpp"
#include "collision/swept_box.hpp"

#include <algorithm>
#include <limits>

namespace trocar::collision {
namespace {

/// Steps for which a normal serves: the bound is valid for any direction.
constexpr std::uint32_t kNormalSteps = 4;
/// Below this the square of a direction's length has lost its digits.
constexpr double kShortest = 0x1p-900;

TROCAR_LANES_INLINE double least(Lanes x) noexcept { return std::min(std::min(x[0], x[1]), std::min(x[2], x[3])); }

/// All faces that touch a vertex of the other cluster, and their clusters.
std::vector<std::vector<Index>> find_neighbours(const SurfacePart& part) {
    const std::size_t clusters = part.tree.clusters().size();
    std::vector<std::pair<Index, Index>> at; // vertex, cluster
    for (Index c = 0; c < clusters; ++c)
        for (const Index v : part.touched_by(c)) at.emplace_back(v, c);
    std::sort(at.begin(), at.end());
    std::vector<std::vector<Index>> neighbours(clusters);
    for (std::size_t i = 0; i < at.size(); ++i)
        for (std::size_t k = i + 1; k < at.size() && at[k].first == at[i].first; ++k) neighbours[at[i].second].push_back(at[k].second);
    for (auto& list : neighbours) {
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    return neighbours;
}

} // namespace

void SessionSides::build(std::span<const SurfacePart> parts, const ShapeView& shapes) {
    parts_ = parts;
    shapes_ = shapes;
    step_ = 0;
    neighbour_pairs_ = 0;
    parts_hulls_.assign(parts.size(), {});
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const SurfacePart& part = parts[p];
        PartHulls& hulls = parts_hulls_[p];
        const auto neighbours = find_neighbours(part);
        hulls.hulls.resize(neighbours.size());
        for (Index c = 0; c < neighbours.size(); ++c) {
            hulls.first_face.push_back(static_cast<Index>(hulls.faces.size()));
            const DopTree::BlockRange& faces = part.tree.clusters()[c].faces;
            for (Index i = 0; i < faces.count; ++i) {
                const Index face = part.tree.block_ids(faces.begin + i / DopTree::kLanes)[i % DopTree::kLanes];
                for (const Index v : part.topology.triangles[face]) hulls.faces.push_back(part.vertex_of[v]);
            }
            hulls.first_neighbour.push_back(static_cast<Index>(hulls.neighbours.size()));
            hulls.neighbours.insert(hulls.neighbours.end(), neighbours[c].begin(), neighbours[c].end());
        }
        neighbour_pairs_ += neighbours.size() + hulls.neighbours.size();
        hulls.first_face.push_back(static_cast<Index>(hulls.faces.size()));
        hulls.first_neighbour.push_back(static_cast<Index>(hulls.neighbours.size()));
    }
}

void SessionSides::start_step(std::span<const SurfaceMotion> motions) noexcept {
    motions_ = motions;
    ++step_;
    hulls_made_ = 0;
}

bool SessionSides::are_neighbours(ClusterPlace a, ClusterPlace b) const noexcept {
    if (a.part != b.part) return false;
    const PartHulls& part = parts_hulls_[a.part];
    const Index low = std::min(a.cluster, b.cluster), high = std::max(a.cluster, b.cluster);
    const auto begin = part.neighbours.begin() + part.first_neighbour[low], end = part.neighbours.begin() + part.first_neighbour[low + 1];
    return low == high || std::find(begin, end, high) != end;
}

namespace {

/// Sum of the faces' normals, each as long as twice its area.
Vec3 mean_normal(std::span<const Vec3> positions, std::span<const Index> corners) noexcept {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < corners.size(); i += 3) {
        const Vec3 &p = positions[corners[i]], &q = positions[corners[i + 1]], &r = positions[corners[i + 2]];
        sum += (q - p).cross(r - p);
    }
    return sum;
}

} // namespace

struct SessionSides::Kernel {
    /// Largest absolute coordinate; NaN or infinite if one is.
    TROCAR_CLONES
    static double size_of(std::span<const double> groups) noexcept {
        Lanes size = all(0.0), none = size;
        for (std::size_t at = 0; at < groups.size(); at += kLanes) {
            const Lanes coordinates = load_lanes(groups.data() + at);
            size = larger(size, magnitude(coordinates));
            none += 0.0 * coordinates; // comparisons pass NaN over
        }
        return -least(-size) + (none[0] + none[1] + none[2] + none[3]);
    }

    TROCAR_CLONES
    static std::array<Range, 2> ranges(std::span<const double> groups, const Vec3& normal) noexcept {
        const Lanes x = all(normal[0]), y = all(normal[1]), z = all(normal[2]);
        Lanes lo0 = all(std::numeric_limits<double>::infinity()), lo1 = lo0, hi0 = -lo0, hi1 = hi0;
        for (std::size_t at = 0; at < groups.size(); at += kShapeGroup) {
            const double* row = groups.data() + at;
            const Lanes at0 = x * load_lanes(row) + y * load_lanes(row + kLanes) + z * load_lanes(row + 2 * kLanes);
            const Lanes at1 = x * load_lanes(row + 3 * kLanes) + y * load_lanes(row + 4 * kLanes) + z * load_lanes(row + 5 * kLanes);
            lo0 = smaller(lo0, at0);
            hi0 = larger(hi0, at0);
            lo1 = smaller(lo1, at1);
            hi1 = larger(hi1, at1);
        }
        return {Range{least(lo0), -least(-hi0)}, Range{least(lo1), -least(-hi1)}};
    }
};

const SessionSides::Hull& SessionSides::make_hull(ClusterPlace place) noexcept {
    PartHulls& part = parts_hulls_[place.part];
    Hull& hull = part.hulls[place.cluster];
    if (hull.step == step_) return hull;
    const SurfaceMotion& motion = motions_[parts_[place.part].surface];
    hull.size = Kernel::size_of(shapes_.of(place));
    if (hull.normal_step == 0 || step_ - hull.normal_step >= kNormalSteps) {
        const Index first_face = part.first_face[place.cluster], last_face = part.first_face[place.cluster + 1];
        hull.normal = mean_normal(motion.t0, std::span(part.faces).subspan(first_face, last_face - first_face));
        hull.normal_step = step_;
    }
    const auto [t0, t1] = Kernel::ranges(shapes_.of(place), hull.normal);
    hull.t0 = t0;
    hull.t1 = t1;
    hull.step = step_;
    ++hulls_made_;
    return hull;
}

SessionSides::Apart SessionSides::apart(ClusterPlace a, ClusterPlace b, double distance) noexcept {
    const Hull &hull_a = make_hull(a), &hull_b = make_hull(b);
    const double size = std::max(hull_a.size, hull_b.size) + 0.0 * (hull_a.size + hull_b.size);
    Apart apart;
    if (!(size <= kLargestCoordinate)) return apart; // NaN is not
    const auto look_along = [&](const Hull& hull, ClusterPlace other, double towards_b) {
        const Vec3& n = hull.normal;
        const double length_sq = n.squaredNorm(), length = std::sqrt(length_sq);
        if (!(length_sq >= kShortest)) return;
        const double bound = distance * (1.0 + 0x1p-40) * length + 0x1p-38 * size * n.lpNorm<1>() + std::numeric_limits<double>::min();
        const auto [t0, t1] = Kernel::ranges(shapes_.of(other), n);
        const double above = t0.lo - hull.t0.hi, below = hull.t0.lo - t0.hi, gap = std::max(above, below) - bound;
        if (!(gap > 0.0)) return;
        const double at_start = gap / length * (1.0 - 0x1p-40);
        if (at_start > apart.at_start) {
            apart.at_start = at_start;
            apart.side = (above > below ? towards_b : -towards_b) / length * n;
        }
        apart.during_step = apart.during_step || (above > below ? t1.lo - hull.t1.hi : hull.t1.lo - t1.hi) > bound;
    };
    look_along(hull_a, b, 1.0);
    if (!apart.during_step) look_along(hull_b, a, -1.0);
    return apart;
}

std::size_t SessionSides::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    std::size_t sum = 0;
    for (const PartHulls& p : parts_hulls_)
        sum += bytes(p.hulls) + bytes(p.faces) + bytes(p.first_face) + bytes(p.neighbours) + bytes(p.first_neighbour);
    return sum;
}

} // namespace trocar::collision
