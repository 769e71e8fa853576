#include "collision/culling/cullide.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::collision {

namespace {

constexpr float kFarDepth = 2.0f;

} // namespace

/// Pixels whose centre the triangle covers: visit(pixel id, depth). Depths are those of one plane, the same bits each time.
template <class Visit>
void Cullide::for_each_sample(Index triangle, Visit&& visit) const {
    const Triangle& t = triangles_[triangle];
    const Corner &a = corners_[t[0]], &b = corners_[t[1]], &c = corners_[t[2]];
    const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    if (area == 0.0) return; // edge-on: it covers no centre
    const auto first = [&](double low) { return std::max(0, static_cast<int>(std::ceil(low - 0.5))); };
    const auto last = [&](double high) { return std::min(size_ - 1, static_cast<int>(std::floor(high - 0.5))); };
    const int x0 = first(std::min({a.x, b.x, c.x})), x1 = last(std::max({a.x, b.x, c.x}));
    const int y0 = first(std::min({a.y, b.y, c.y})), y1 = last(std::max({a.y, b.y, c.y}));
    for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
            const double px = x + 0.5 - a.x, py = y + 0.5 - a.y;
            const double v = (px * (c.y - a.y) - (c.x - a.x) * py) / area, w = ((b.x - a.x) * py - px * (b.y - a.y)) / area;
            if (v < 0.0 || w < 0.0 || v + w > 1.0) continue;
            const auto depth = static_cast<float>(a.z + v * (b.z - a.z) + w * (c.z - a.z));
            if (!visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(size_) + static_cast<std::size_t>(x), depth)) return;
        }
}

void Cullide::draw(Index patch) {
    const auto& p = hierarchy_.patches[patch];
    for (Index k = p.begin; k < p.end; ++k)
        for_each_sample(hierarchy_.order[k], [&](std::size_t at, float depth) {
            depth_[at] = std::min(depth_[at], depth);
            return true;
        });
}

bool Cullide::is_hidden(Index patch) const {
    const auto& p = hierarchy_.patches[patch];
    bool hidden = false;
    for (Index k = p.begin; k < p.end && !hidden; ++k)
        for_each_sample(hierarchy_.order[k], [&](std::size_t at, float depth) { return !(hidden = depth > depth_[at]); });
    return hidden;
}

void Cullide::look(std::span<const Vec3> positions, int axis, const CullidePlan& plan) {
    size_ = plan.resolution;
    const ViewDirection view = view_along_axis(axis, false);
    std::vector<SweptCorners> prisms;
    for (const Index patch : live_)
        for (Index k = hierarchy_.patches[patch].begin; k < hierarchy_.patches[patch].end; ++k) {
            const Triangle& t = triangles_[hierarchy_.order[k]];
            prisms.push_back({positions[t[0]], positions[t[1]], positions[t[2]], positions[t[0]], positions[t[1]], positions[t[2]]});
        }
    const CullFrame f = make_cull_frame(view, prisms, 0.0, size_, size_);
    corners_.resize(positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v)
        corners_[v] = {(view.right.dot(positions[v]) - f.left) * f.pixels_x, (view.up.dot(positions[v]) - f.bottom) * f.pixels_y,
                       (view.forward.dot(positions[v]) - f.nearest) * f.depth_scale};
    CullidePass pass{.patches = live_.size(), .triangles = prisms.size(), .queries = 2 * live_.size()};
    std::vector<std::uint8_t> hidden(live_.size(), 0);
    depth_.assign(static_cast<std::size_t>(size_) * static_cast<std::size_t>(size_), kFarDepth);
    for (std::size_t k = 0; k < live_.size(); ++k) { // forward: against itself and those before
        draw(live_[k]);
        hidden[k] = is_hidden(live_[k]);
    }
    std::fill(depth_.begin(), depth_.end(), kFarDepth);
    for (std::size_t k = live_.size(); k-- > 0;) { // backward: against those after
        hidden[k] = hidden[k] || is_hidden(live_[k]);
        draw(live_[k]);
    }
    std::vector<Index> left;
    for (std::size_t k = 0; k < live_.size(); ++k) {
        if (!hidden[k]) continue;
        const Index child = hierarchy_.patches[live_[k]].left;
        if (child == kNoIndex)
            left.push_back(live_[k]);
        else
            left.insert(left.end(), {child, child + 1});
    }
    pass.pruned = static_cast<std::size_t>(std::count(hidden.begin(), hidden.end(), 0));
    live_ = std::move(left);
    passes_.push_back(pass);
}

std::vector<Index> Cullide::find_colliding_set(std::span<const Vec3> positions, const CullidePlan& plan) {
    passes_.clear();
    live_.clear();
    if (!hierarchy_.patches.empty()) live_.push_back(0);
    int idle = 0;
    for (int pass = 0; pass < plan.max_passes && !live_.empty() && idle < plan.idle_passes; ++pass) {
        look(positions, pass % 3, plan);
        const bool all_single =
            std::all_of(live_.begin(), live_.end(), [&](Index patch) { return hierarchy_.patches[patch].left == kNoIndex; });
        idle = all_single && passes_.back().pruned == 0 ? idle + 1 : 0;
    }
    std::vector<Index> ids;
    for (const Index patch : live_)
        for (Index k = hierarchy_.patches[patch].begin; k < hierarchy_.patches[patch].end; ++k) ids.push_back(hierarchy_.order[k]);
    std::sort(ids.begin(), ids.end());
    return ids;
}

} // namespace trocar::collision
