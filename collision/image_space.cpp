#include "collision/image_space.hpp"

#include "base/self_intersection.hpp"
#include "collision/swept_box.hpp"

#include <algorithm>
#include <numeric>

namespace seldinger::collision {
namespace {

/// Seen along the axes first; then along the normal of what is left, where it looks flattest; then along diagonals.
constexpr int kAxisPasses = 3;
const Vec3 kDiagonals[] = {{1.0, 1.0, 1.0}, {1.0, -1.0, 1.0}, {-1.0, 1.0, 1.0}, {1.0, 1.0, -1.0}, {1.0, 2.0, 0.5}, {-0.5, 1.0, 2.0}};

} // namespace

ImageSpaceCuller::ImageSpaceCuller(std::span<const Triangle> triangles, std::size_t vertex_count)
    : triangles_(triangles.begin(), triangles.end()), sets_(make_chromatic_sets(triangles, vertex_count)) {}

Vec3 ImageSpaceCuller::direction_of(int pass, std::span<const Vec3> positions) const noexcept {
    if (pass < kAxisPasses) return Vec3::Unit(pass);
    if (pass > kAxisPasses) return kDiagonals[static_cast<std::size_t>(pass - kAxisPasses - 1) % std::size(kDiagonals)];
    Vec3 sum = Vec3::Zero();
    for (const Index t : live_) {
        const Triangle& c = triangles_[t];
        const Vec3 normal = (positions[c[1]] - positions[c[0]]).cross(positions[c[2]] - positions[c[0]]);
        sum += normal.dot(sum) < 0.0 ? Vec3(-normal) : normal; // a fold's two sides count alike
    }
    return sum.allFinite() && sum.norm() > 0.0 ? sum : Vec3(1.0, 1.0, 1.0);
}

Result<void> ImageSpaceCuller::look(std::span<const Vec3> positions, const Vec3& direction, const ImageSpacePlan& plan, int resolution,
                                    CullBackend& backend) {
    std::vector<Index> place(triangles_.size(), kNoIndex);
    std::vector<SweptCorners> prisms;
    std::vector<Triangle> corners;
    for (const Index t : live_) {
        place[t] = static_cast<Index>(prisms.size());
        const Triangle& c = triangles_[t];
        prisms.push_back({positions[c[0]], positions[c[1]], positions[c[2]], positions[c[0]], positions[c[1]], positions[c[2]]});
        corners.push_back(c);
    }
    std::vector<Index> set_begin{0}, members;
    std::vector<CullQuestion> questions;
    std::vector<std::size_t> question_begin{0};
    for (Index set = 0; set < sets_.count(); ++set) {
        for (const Index t : sets_.set(set))
            if (place[t] != kNoIndex) members.push_back(place[t]);
        if (members.size() > set_begin.back()) // nobody left to meet: all are free of it
            for (const Index t : asking_[set])
                if (place[t] != kNoIndex) questions.push_back({place[t], set});
        set_begin.push_back(static_cast<Index>(members.size()));
        question_begin.push_back(questions.size());
    }
    std::vector<Footprint> footprints(prisms.size());
    for (;; resolution /= 2) {
        const CullFrame frame = make_cull_frame(view_along(direction), prisms, 0.0, resolution, resolution);
        for (std::size_t p = 0; p < prisms.size(); ++p) footprints[p] = make_footprint(frame, prisms[p]);
        if (resolution < 2 || are_small_enough(footprints, questions)) break;
    }
    std::vector<std::uint8_t> hits(questions.size(), 1);
    const CullJob job{.width = resolution,
                      .height = resolution,
                      .footprints = footprints,
                      .corners = corners,
                      .set_begin = set_begin,
                      .set_members = members,
                      .questions = questions,
                      .question_begin = question_begin,
                      .memory = plan.memory};
    auto done = backend.find_hits(job, hits);
    if (!done.ok()) return done;
    passes_.push_back({direction, live_.size(), 0, questions.size()});
    for (auto& list : asking_) list.clear();
    std::vector<std::uint8_t> left(prisms.size(), 0);
    for (std::size_t q = 0; q < questions.size(); ++q) {
        if (!hits[q]) continue;
        asking_[questions[q].set].push_back(live_[questions[q].prism]);
        left[questions[q].prism] = 1;
    }
    std::size_t kept = 0;
    for (std::size_t p = 0; p < left.size(); ++p)
        if (left[p]) live_[kept++] = live_[p];
    live_.resize(kept);
    passes_.back().triangles_left = kept;
    return done;
}

Result<std::vector<Index>> ImageSpaceCuller::find_colliding_set(std::span<const Vec3> positions, const ImageSpacePlan& plan,
                                                                CullBackend& backend) {
    passes_.clear();
    live_.clear();
    const auto bounded = [&](Index v) { return positions[v].allFinite() && positions[v].cwiseAbs().maxCoeff() <= kLargestCoordinate; };
    for (Index t = 0; t < triangles_.size(); ++t)
        if (std::all_of(triangles_[t].begin(), triangles_[t].end(), bounded)) live_.push_back(t);
    asking_.assign(sets_.count(), live_);
    const int resolution = std::clamp(plan.resolution > 0 ? plan.resolution : backend.preferred_resolution(), 1, kLargestPicture);
    for (int pass = 0; pass < plan.max_passes && !live_.empty(); ++pass) {
        auto looked = look(positions, direction_of(pass, positions), plan, resolution, backend);
        if (!looked.ok()) return looked.error();
        const ImageSpacePass& last = passes_.back();
        const auto pruned = static_cast<double>(last.triangles - last.triangles_left);
        if (pass + 1 >= kAxisPasses && pruned < plan.worthwhile * static_cast<double>(last.triangles)) break;
    }
    return live_;
}

std::vector<TrianglePair> find_crossings(std::span<const Triangle> triangles, std::span<const Vec3> positions, std::span<const Index> ids) {
    TriMesh part{{positions.begin(), positions.end()}, {}};
    for (const Index id : ids) part.triangles.push_back(triangles[id]);
    std::vector<TrianglePair> pairs;
    for (const auto& [a, b] : find_self_intersections(part).pairs) pairs.push_back({std::min(ids[a], ids[b]), std::max(ids[a], ids[b])});
    std::sort(pairs.begin(), pairs.end(), [](const TrianglePair& x, const TrianglePair& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
    return pairs;
}

} // namespace seldinger::collision
