#include "collision/culling/image_space.hpp"

#include "base/self_intersection.hpp"
#include "collision/swept_box.hpp"

#include <algorithm>
#include <numeric>

namespace trocar::collision {
namespace {

/// Views along the axes first; then along the normal of what is left, where its projection is largest; then along diagonals.
constexpr int kAxisPasses = 3;
/// Triangles of a patch, level by level. Larger ones of a closed surface never pass, and those of fewer cost as much as their triangles.
constexpr std::size_t kPatchSizes[] = {256, 64, 16};
/// Fewer patches than this are too large for a surface that has so few triangles.
constexpr std::size_t kLeastPatches = 128;
/// Pixels per patch on average: their hulls are told apart by what is around a patch, which is finer than the patch.
constexpr double kPixelsPerPatch = 256.0;
const Vec3 kDiagonals[] = {{1.0, 1.0, 1.0}, {1.0, -1.0, 1.0}, {-1.0, 1.0, 1.0}, {1.0, 1.0, -1.0}, {1.0, 2.0, 0.5}, {-0.5, 1.0, 2.0}};

} // namespace

ImageSpaceCuller::ImageSpaceCuller(std::span<const Triangle> triangles, std::size_t vertex_count)
    : triangles_(triangles.begin(), triangles.end()), vertex_count_(vertex_count), sets_(make_chromatic_sets(triangles, vertex_count)) {}

/// Which views pruned most of what was left at their turn?
void ImageSpaceCuller::keep_view_order() {
    std::vector<ImageSpacePass> order = passes_;
    const auto share = [](const ImageSpacePass& p) {
        return p.triangles == 0 ? 0.0 : static_cast<double>(p.triangles - p.triangles_left) / static_cast<double>(p.triangles);
    };
    std::stable_sort(order.begin(), order.end(), [&](const auto& x, const auto& y) { return share(x) > share(y); });
    best_views_.clear();
    for (const ImageSpacePass& pass : order)
        if (pass.patches == 0) best_views_.push_back(pass.direction);
}

Vec3 ImageSpaceCuller::direction_of(int pass, std::span<const Vec3> positions, const ImageSpacePlan& plan) const noexcept {
    if (plan.coherent_views && static_cast<std::size_t>(pass) < best_views_.size()) return best_views_[static_cast<std::size_t>(pass)];
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

void ImageSpaceCuller::prepare_patches() {
    if (!patches_) patches_.emplace(triangles_, vertex_count_);
}

Result<void> ImageSpaceCuller::cull_patches(std::span<const Vec3> positions, const ImageSpacePlan& plan, CullBackend& backend) {
    prepare_patches();
    patches_->start(positions, live_);
    for (const std::size_t largest : kPatchSizes) {
        if (live_.size() < kLeastPatches * largest) continue;
        patches_->start_level(live_, largest);
        const std::size_t level_begin = live_.size();
        for (int view = 0; view < kAxisPasses && patches_->patches_asking() > 0; ++view) {
            ImageSpacePass pass{.direction = Vec3::Unit(view),
                                .largest_patch = largest,
                                .patches = patches_->patches_left(),
                                .asking = patches_->patches_asking()};
            const auto outcome =
                patches_->look(view_along(pass.direction),
                               {.resolution = plan.resolution, .pixels_per_footprint = kPixelsPerPatch, .memory = plan.memory}, backend);
            if (!outcome.ok()) return outcome.error();
            pass.triangles = live_.size();
            patches_->drop_pruned(live_);
            pass.triangles_left = live_.size();
            pass.questions = patches_->questions();
            pass.resolution = outcome->resolution;
            pass.lowered_for_memory = outcome->lowered_for_memory;
            passes_.push_back(pass);
            if (plan.watch) plan.watch(pass);
        }
        // smaller patches only where these paid: a creased or strongly self-occluding surface has none to prune
        if (static_cast<double>(level_begin - live_.size()) < plan.worthwhile * static_cast<double>(level_begin)) break;
    }
    return {};
}

Result<void> ImageSpaceCuller::look(std::span<const Vec3> positions, const Vec3& direction, const ImageSpacePlan& plan,
                                    CullBackend& backend) {
    std::vector<Index> place(triangles_.size(), kNoIndex);
    view_.prisms.clear();
    view_.corners.clear();
    for (const Index t : live_) {
        place[t] = static_cast<Index>(view_.prisms.size());
        const Triangle& c = triangles_[t];
        view_.prisms.push_back({positions[c[0]], positions[c[1]], positions[c[2]], positions[c[0]], positions[c[1]], positions[c[2]]});
        view_.corners.push_back(c);
    }
    view_.set_begin.assign(1, 0);
    view_.set_members.clear();
    view_.questions.clear();
    view_.question_begin.assign(1, 0);
    for (Index set = 0; set < sets_.count(); ++set) {
        for (const Index t : sets_.set(set))
            if (place[t] != kNoIndex) view_.set_members.push_back(place[t]);
        if (view_.set_members.size() > view_.set_begin.back()) // no other triangle left: all are free of it
            for (const Index t : asking_[set])
                if (place[t] != kNoIndex) view_.questions.push_back({place[t], set});
        view_.set_begin.push_back(static_cast<Index>(view_.set_members.size()));
        view_.question_begin.push_back(view_.questions.size());
    }
    const auto outcome = view_.look(view_along(direction), {.resolution = plan.resolution, .memory = plan.memory}, backend);
    if (!outcome.ok()) return outcome.error();
    passes_.push_back({direction, live_.size(), 0, view_.questions.size(), outcome->resolution, outcome->lowered_for_memory});
    for (auto& list : asking_) list.clear();
    std::vector<std::uint8_t> left(live_.size(), 0);
    for (std::size_t q = 0; q < view_.questions.size(); ++q) {
        if (!view_.hits[q]) continue;
        const auto [prism, set] = view_.questions[q];
        asking_[set].push_back(live_[prism]);
        left[prism] = 1;
    }
    std::size_t kept = 0;
    for (std::size_t p = 0; p < left.size(); ++p)
        if (left[p]) live_[kept++] = live_[p];
    live_.resize(kept);
    passes_.back().triangles_left = kept;
    return {};
}

Result<std::vector<Index>> ImageSpaceCuller::find_colliding_set(std::span<const Vec3> positions, const ImageSpacePlan& plan,
                                                                CullBackend& backend) {
    passes_.clear();
    live_.clear();
    const auto bounded = [&](Index v) { return positions[v].allFinite() && positions[v].cwiseAbs().maxCoeff() <= kLargestCoordinate; };
    for (Index t = 0; t < triangles_.size(); ++t)
        if (std::all_of(triangles_[t].begin(), triangles_[t].end(), bounded)) live_.push_back(t);
    if (plan.patches) {
        auto looked = cull_patches(positions, plan, backend);
        if (!looked.ok()) return looked.error();
    }
    asking_.assign(sets_.count(), live_);
    for (int pass = 0; pass < plan.max_passes && !live_.empty(); ++pass) {
        auto looked = look(positions, direction_of(pass, positions, plan), plan, backend);
        if (!looked.ok()) return looked.error();
        const ImageSpacePass& last = passes_.back();
        if (plan.watch) plan.watch(last);
        if (pass + 1 < kAxisPasses) continue;
        const auto pruned = static_cast<double>(last.triangles - last.triangles_left);
        if (!(plan.go_on ? plan.go_on(last) : pruned >= plan.worthwhile * static_cast<double>(last.triangles))) break;
    }
    keep_view_order();
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

} // namespace trocar::collision
