#include "collision/culling/cull_twin.hpp"

#include "collision/culling/chromatic_sets.hpp"

namespace trocar::collision {
namespace {

/// Behind everything: depths lie inside (0, 1).
constexpr float kFar = 2.0f;

/// Calls visit(pixel id, depths) for every pixel of the footprint until it returns false.
template <class Visit>
bool for_each_pixel(const Footprint& p, int width, Visit&& visit) {
    for (std::int32_t y = p.y0; y < p.y1; ++y) {
        const auto v = static_cast<float>(y - p.y0);
        for (std::int32_t x = p.x0; x < p.x1; ++x) {
            const auto u = static_cast<float>(x - p.x0);
            if (!covers(p, u, v)) continue;
            const DepthInterval d = depths(p, u, v);
            if (d.front > d.back) continue; // a corner of the pixel within the hull's bounds only
            if (!visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x), d)) return false;
        }
    }
    return true;
}

} // namespace

void CpuCullBackend::draw(const CullJob& job, Index prism) {
    for_each_pixel(job.footprints[prism], job.width, [&](std::size_t at, DepthInterval d) {
        Pixel& p = picture_[at];
        if (p.turn != turn_) {
            p = {turn_, prism, kNoIndex, d.front, d.back, kFar, kFar, kFar};
        } else if (d.front < p.first_front) {
            p = {turn_, prism, p.first, d.front, d.back, p.first_front, p.first_back, p.second_front};
        } else if (d.front < p.second_front) {
            p = {turn_, p.first, prism, p.first_front, p.first_back, d.front, d.back, p.second_front};
        } else if (d.front < p.third_front) {
            p.third_front = d.front;
        }
        return true;
    });
}

bool CpuCullBackend::is_hit(const CullJob& job, Index prism) const noexcept {
    const Triangle& own = job.corners[prism];
    const bool intervals = job.memory == CullMemory::Intervals;
    return !for_each_pixel(job.footprints[prism], job.width, [&](std::size_t at, DepthInterval d) {
        const Pixel& p = picture_[at];
        if (p.turn != turn_ || d.back < p.first_front) return true;
        const bool first_is_neighbour = are_adjacent(own, job.corners[p.first]);
        if (!intervals) return first_is_neighbour && d.back < p.second_front;
        const bool free_of_first = first_is_neighbour || d.front > p.first_back;
        if (!free_of_first) return false;
        if (d.back < p.second_front) return true;
        const bool free_of_second = d.front > p.second_back || are_adjacent(own, job.corners[p.second]);
        return free_of_second && d.back < p.third_front;
    });
}

void CpuCullBackend::reserve(std::size_t, std::size_t, int resolution) {
    const auto side = static_cast<std::size_t>(resolution);
    if (picture_.size() < side * side) picture_.resize(side * side);
}

Result<void> CpuCullBackend::find_hits(const CullJob& job, std::span<std::uint8_t> hits) {
    const std::size_t pixels = static_cast<std::size_t>(job.width) * static_cast<std::size_t>(job.height);
    if (picture_.size() < pixels) picture_.resize(pixels);
    for (Index set = 0; set < job.set_count(); ++set) {
        const std::size_t begin = job.question_begin[set], end = job.question_begin[set + 1];
        if (begin == end) continue;
        if (++turn_ == 0) { // the counter wrapped round
            for (Pixel& p : picture_) p.turn = 0;
            turn_ = 1;
        }
        for (Index k = job.set_begin[set]; k < job.set_begin[set + 1]; ++k) draw(job, job.set_members[k]);
        for (std::size_t q = begin; q < end; ++q) hits[q] = is_hit(job, job.questions[q].prism);
    }
    return {};
}

} // namespace trocar::collision
