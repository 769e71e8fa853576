#include "collision/culling/patch_culler.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace trocar::collision {
namespace {

/// Patches at one vertex beyond which they are not listed as touching: a hub would cost the square of them. Condition 1 is not proven
/// there, and a patch that is not listed is not exempt.
constexpr std::size_t kMostAtVertex = 24;
/// Faces of a patch and those that touch it beyond which condition 1 is not tried: the outline would be too long.
constexpr std::size_t kLargestRegion = 8192;
/// Patches of one set that may touch the same patch. Two are distinguished from a third by the values stored per pixel.
constexpr std::uint8_t kMostNearInSet = 2;
constexpr Index kMostSets = 48;
/// Least scalar product of a face's normal with the direction: of its length, and of the product of its edges' lengths, whose rounding
/// is some 1e-15.
constexpr double kLeastCosine = 0.005, kNormalRounding = 1e-12;
constexpr Index kSeveral = kNoIndex - 1;

} // namespace

PatchCuller::PatchCuller(std::span<const Triangle> triangles, std::size_t vertex_count)
    : triangles_(triangles.begin(), triangles.end()), hierarchy_(make_patch_hierarchy(triangles, vertex_count)), stamp_(vertex_count, 0),
      in_region_(triangles.size(), 0) {
    find_across();
}

void PatchCuller::find_across() {
    struct Side {
        Index low, high, triangle;
        std::uint8_t corner, turned;
    };
    std::vector<Side> sides;
    for (Index t = 0; t < triangles_.size(); ++t)
        for (std::uint8_t k = 0; k < 3; ++k) {
            const Index a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), t, k, a > b});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.low, x.high, x.triangle, x.corner) < std::tie(y.low, y.high, y.triangle, y.corner);
    });
    across_.assign(triangles_.size(), {kNoIndex, kNoIndex, kNoIndex});
    for (std::size_t first = 0, end = 0; first < sides.size(); first = end) {
        while (end < sides.size() && sides[end].low == sides[first].low && sides[end].high == sides[first].high) ++end;
        if (end - first == 1) continue;
        const bool two = end - first == 2 && sides[first].turned != sides[first + 1].turned;
        for (std::size_t k = first; k < end; ++k)
            across_[sides[k].triangle][sides[k].corner] = two ? sides[k == first ? first + 1 : first].triangle : kSeveral;
    }
}

void PatchCuller::start(std::span<const Vec3> positions, std::span<const Index> live) {
    positions_ = positions;
    normals_.assign(triangles_.size(), Vec3::Zero());
    is_proven_.assign(triangles_.size(), 0);
    for (const Index t : live) {
        const Triangle& c = triangles_[t];
        normals_[t] = (positions[c[1]] - positions[c[0]]).cross(positions[c[2]] - positions[c[0]]);
    }
}

void PatchCuller::start_level(std::span<const Index> live, std::size_t largest) {
    cut(live, largest);
    find_touching();
    make_sets();
    patches_left_ = patches_.size();
    asking_left_ = 0;
    std::vector<std::size_t> in_set(asking_.size(), 0), near_in_set(asking_.size());
    for (const Patch& patch : patches_) ++in_set[patch.set];
    for (Index p = 0; p < patches_.size(); ++p) {
        Patch& patch = patches_[p];
        patch.asks = is_proven(p);
        if (!patch.asks) continue;
        for (const Index t : members(p)) is_proven_[t] = 1;
        ++asking_left_;
        std::fill(near_in_set.begin(), near_in_set.end(), 0);
        for (const Index other : touching(p)) ++near_in_set[patches_[other].set];
        ++near_in_set[patch.set];
        for (Index set = 0; set < asking_.size(); ++set) {
            if (in_set[set] == near_in_set[set]) continue; // none there but those that it touches
            asking_[set].push_back(p);
            ++patch.sets_left;
        }
    }
}

/// The largest ranges of the hierarchy that are small enough.
void PatchCuller::cut(std::span<const Index> live, std::size_t largest) {
    is_live_.assign(triangles_.size(), 0);
    for (const Index t : live) is_live_[t] = 1;
    patches_.clear();
    members_.clear();
    std::vector<Index> open;
    if (!hierarchy_.patches.empty()) open.push_back(0);
    while (!open.empty()) {
        const auto [begin, end, left] = hierarchy_.patches[open.back()];
        open.pop_back();
        if (end - begin > largest && left != kNoIndex) {
            open.insert(open.end(), {left + 1, left});
            continue;
        }
        const auto first = static_cast<Index>(members_.size());
        for (Index k = begin; k < end; ++k)
            if (is_live_[hierarchy_.order[k]]) members_.push_back(hierarchy_.order[k]);
        if (members_.size() > first) patches_.push_back({first, static_cast<Index>(members_.size())});
    }
}

void PatchCuller::find_touching() {
    vertices_.clear();
    vertex_begin_.assign(1, 0);
    for (Index p = 0; p < patches_.size(); ++p) {
        if (++stamp_now_ == 0) { // the counter wrapped round
            std::fill(stamp_.begin(), stamp_.end(), 0);
            stamp_now_ = 1;
        }
        for (const Index t : members(p))
            for (const Index v : triangles_[t])
                if (stamp_[v] != stamp_now_) {
                    stamp_[v] = stamp_now_;
                    vertices_.push_back(v);
                }
        vertex_begin_.push_back(static_cast<Index>(vertices_.size()));
    }
    std::vector<Index> begin(stamp_.size() + 1, 0), at_vertex(vertices_.size());
    for (const Index v : vertices_) ++begin[v + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<Index> next(begin.begin(), begin.end() - 1);
    for (Index p = 0; p < patches_.size(); ++p)
        for (const Index v : corners(p)) at_vertex[next[v]++] = p;
    near_.clear();
    near_begin_.assign(1, 0);
    for (Index p = 0; p < patches_.size(); ++p) {
        const std::size_t first = near_.size();
        for (const Index v : corners(p)) {
            if (begin[v + 1] - begin[v] > kMostAtVertex) {
                patches_[p].at_hub = true;
                continue;
            }
            for (Index k = begin[v]; k < begin[v + 1]; ++k)
                if (at_vertex[k] != p) near_.push_back(at_vertex[k]);
        }
        const auto start = near_.begin() + static_cast<std::ptrdiff_t>(first);
        std::sort(start, near_.end());
        near_.erase(std::unique(start, near_.end()), near_.end());
        near_begin_.push_back(static_cast<Index>(near_.size()));
    }
}

/// First fit: no patch of a set touches another of it, and a patch touches few of any set. Where the sets do not suffice the last one
/// takes the rest; that prunes less, and is no less safe.
void PatchCuller::make_sets() {
    taken_.assign(patches_.size() * kMostSets, 0); // [patch][set] how many it touches
    Index count = 0;
    std::uint64_t forbidden = 0;
    static_assert(kMostSets <= 64);
    for (Index p = 0; p < patches_.size(); ++p) {
        forbidden = 0;
        for (const Index other : touching(p))
            for (Index set = 0; set < count; ++set) {
                const bool full = taken_[other * std::size_t{kMostSets} + set] >= kMostNearInSet;
                if (full || (other < p && patches_[other].set == set)) forbidden |= std::uint64_t{1} << set;
            }
        Index set = 0;
        while (set + 1 < kMostSets && (forbidden >> set & 1) != 0) ++set;
        patches_[p].set = set;
        count = std::max(count, set + 1);
        for (const Index other : touching(p)) {
            std::uint8_t& taken = taken_[other * std::size_t{kMostSets} + set];
            taken += taken < 255;
        }
    }
    asking_.assign(count, {});
}

/// Edges of the region's faces that none of its faces runs through the other way; false: some edge is not that simple.
bool PatchCuller::find_border() {
    if (++region_now_ == 0) { // the counter wrapped round
        std::fill(in_region_.begin(), in_region_.end(), 0);
        region_now_ = 1;
    }
    for (const Index t : region_) in_region_[t] = region_now_;
    border_.clear();
    for (const Index t : region_)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index other = across_[t][k];
            if (other == kSeveral || border_.size() > kLongestContour) return false;
            if (other == kNoIndex || in_region_[other] != region_now_) border_.push_back({triangles_[t][k], triangles_[t][(k + 1) % 3]});
        }
    return true;
}

bool PatchCuller::is_turned_one_way(const Vec3& direction) const {
    return std::all_of(region_.begin(), region_.end(), [&](Index t) {
        const double along = normals_[t].dot(direction);
        if (!(along > 0.0) || !(along * along > kLeastCosine * kLeastCosine * normals_[t].squaredNorm())) return false;
        const Triangle& c = triangles_[t];
        const double edges_sq = (positions_[c[1]] - positions_[c[0]]).squaredNorm() * (positions_[c[2]] - positions_[c[0]]).squaredNorm();
        return along * along > kNormalRounding * kNormalRounding * edges_sq;
    });
}

/// Condition 1, of the patch and all that it touches.
bool PatchCuller::is_proven(Index patch) {
    if (is_proven_[members(patch).front()]) return true; // by the larger patch that held it
    if (patches_[patch].at_hub) return false;
    region_.assign(members(patch).begin(), members(patch).end());
    for (const Index other : touching(patch)) {
        region_.insert(region_.end(), members(other).begin(), members(other).end());
        if (region_.size() > kLargestRegion) return false;
    }
    Vec3 direction = Vec3::Zero();
    for (const Index t : region_) direction += normals_[t];
    const double length = direction.norm();
    if (!(length > 1e-150 && length < 1e150)) return false;
    direction /= length;
    if (!is_turned_one_way(direction) || !find_border() || !make_contour(border_, contour_)) return false;
    return outline_.is_simple({contour_.vertices, contour_.loop_ends}, {nullptr, positions_, positions_}, direction);
}

/// A patch that queries a set that it touches does so under a separate prism, whose neighbours are the patches it touches there.
Index PatchCuller::place_of_asker(Index patch, Index set) {
    if (patches_[patch].set == set) return place_[patch];
    Triangle exempt{};
    std::size_t count = 0;
    for (const Index other : touching(patch))
        if (patches_[other].set == set && !patches_[other].pruned && count < exempt.size()) exempt[count++] = other;
    if (count == 0) return place_[patch];
    for (std::size_t k = count; k < exempt.size(); ++k) exempt[k] = exempt[0];
    const auto place = static_cast<Index>(view_.corners.size());
    view_.corners.push_back(exempt);
    view_.hulls.hull_of.push_back(place_[patch]);
    return place;
}

void PatchCuller::gather_view() {
    CullHulls& hulls = view_.hulls;
    hulls.points.clear();
    hulls.begin.assign(1, 0);
    hulls.normals.clear();
    hulls.hull_of.clear();
    view_.corners.clear();
    place_.assign(patches_.size(), kNoIndex);
    for (Index p = 0; p < patches_.size(); ++p) {
        if (patches_[p].pruned) continue;
        place_[p] = static_cast<Index>(hulls.normals.size());
        for (const Index v : corners(p)) hulls.points.push_back(positions_[v]);
        hulls.begin.push_back(static_cast<Index>(hulls.points.size()));
        Vec3 normal = Vec3::Zero();
        for (const Index t : members(p)) normal += normals_[t];
        hulls.normals.push_back(normal.allFinite() ? normal : Vec3(Vec3::Zero()));
        hulls.hull_of.push_back(place_[p]);
        view_.corners.push_back({p, p, p});
    }
    const auto sets = static_cast<Index>(asking_.size());
    view_.set_begin.assign(sets + 1, 0);
    for (const Patch& patch : patches_)
        if (!patch.pruned) ++view_.set_begin[patch.set + 1];
    std::partial_sum(view_.set_begin.begin(), view_.set_begin.end(), view_.set_begin.begin());
    view_.set_members.resize(view_.set_begin.back());
    std::vector<Index> next(view_.set_begin.begin(), view_.set_begin.end() - 1);
    for (Index p = 0; p < patches_.size(); ++p)
        if (!patches_[p].pruned) view_.set_members[next[patches_[p].set]++] = place_[p];
    view_.questions.clear();
    view_.question_begin.assign(1, 0);
    for (Index set = 0; set < sets; ++set) {
        for (const Index p : asking_[set]) view_.questions.push_back({place_of_asker(p, set), set});
        view_.question_begin.push_back(view_.questions.size());
    }
}

Result<CullView::Outcome> PatchCuller::look(const ViewDirection& direction, const CullView::Settings& settings, CullBackend& backend) {
    gather_view();
    pruned_ = 0;
    auto outcome = view_.look(direction, settings, backend);
    if (!outcome.ok()) return outcome.error();
    std::size_t q = 0;
    for (auto& list : asking_) {
        std::size_t kept = 0;
        for (const Index p : list)
            if (view_.hits[q++])
                list[kept++] = p;
            else
                --patches_[p].sets_left;
        list.resize(kept);
    }
    for (Patch& patch : patches_) {
        if (!patch.asks || patch.pruned || patch.sets_left > 0) continue;
        patch.pruned = true;
        --patches_left_;
        --asking_left_;
        pruned_ += patch.end - patch.begin;
    }
    return outcome;
}

void PatchCuller::drop_pruned(std::vector<Index>& live) const {
    std::vector<std::uint8_t> gone(triangles_.size(), 0);
    for (Index p = 0; p < patches_.size(); ++p)
        if (patches_[p].pruned)
            for (const Index t : members(p)) gone[t] = 1;
    std::erase_if(live, [&](Index t) { return gone[t] != 0; });
}

} // namespace trocar::collision
