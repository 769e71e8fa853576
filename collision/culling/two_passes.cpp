#include "collision/culling/two_passes.hpp"

#include "collision/culling/chromatic_sets.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

constexpr float kFar = 1.0f; // behind everything: depths lie inside (0, 1)

template <class Visit>
void for_each_pixel(const Footprint& p, int width, Visit&& visit) {
    for (std::int32_t y = p.y0; y < p.y1; ++y)
        for (std::int32_t x = p.x0; x < p.x1; ++x) {
            const auto u = static_cast<float>(x - p.x0), v = static_cast<float>(y - p.y0);
            const DepthInterval d = depths(p, u, v);
            if (covers(p, u, v) && d.front <= d.back)
                visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x), d);
        }
}

ChromaticSets sets_of(const CullJob& job) {
    ChromaticSets sets;
    sets.set_of.assign(job.corners.size(), kNoIndex);
    sets.begin.assign(job.set_begin.begin(), job.set_begin.end());
    sets.members.assign(job.set_members.begin(), job.set_members.end());
    for (Index set = 0; set < job.set_count(); ++set)
        for (const Index prism : sets.set(set)) sets.set_of[prism] = set;
    return sets;
}

} // namespace

Result<void> CpuCanvas::start(const CullJob& job) {
    job_ = job;
    behind_.clear();
    depth_.assign(static_cast<std::size_t>(job.width) * static_cast<std::size_t>(job.height), kFar);
    return {};
}

void CpuCanvas::clear() { std::fill(depth_.begin(), depth_.end(), kFar); }

void CpuCanvas::ask(Index prism) {
    bool behind = false;
    for_each_pixel(job_.footprints[prism], job_.width, [&](std::size_t at, DepthInterval d) { behind = behind || d.back >= depth_[at]; });
    behind_.push_back(behind);
}

void CpuCanvas::draw(Index prism) {
    for_each_pixel(job_.footprints[prism], job_.width,
                   [&](std::size_t at, DepthInterval d) { depth_[at] = std::min(depth_[at], d.front); });
}

Result<void> CpuCanvas::answer(std::vector<std::uint8_t>& behind) {
    behind.assign(behind_.begin(), behind_.end());
    behind_.clear();
    return {};
}

Result<std::uint64_t> find_hits_in_two_passes(const CullJob& job, VisibilityCanvas& canvas, std::span<std::uint8_t> hits) {
    const ChromaticSets sets = sets_of(job);
    Index vertices = 0;
    for (const Triangle& t : job.corners) vertices = std::max({vertices, t[0] + 1, t[1] + 1, t[2] + 1});
    const TriangleStars stars(job.corners, vertices);
    std::uint64_t queries = 0;
    std::vector<std::uint8_t> behind(job.corners.size()), answers;
    std::vector<Index> asked;
    if (auto ready = canvas.start(job); !ready.ok()) return ready.error();
    for (Index j = 0; j < job.set_count(); ++j) {
        asked.clear();
        for (Index i = 0; i < job.set_count(); ++i) {
            std::vector<SetSlot> slots = pair_sets(sets, job.corners, stars, i, j);
            for (int pass = 0; pass < 2; ++pass) { // from the last to the first, then from the first to the last
                std::reverse(slots.begin(), slots.end());
                canvas.clear();
                for (const SetSlot& slot : slots) {
                    if (slot.of_i != kNoIndex) {
                        canvas.ask(slot.of_i);
                        asked.push_back(slot.of_i);
                    }
                    if (slot.of_j != kNoIndex) canvas.draw(slot.of_j);
                }
            }
        }
        if (auto answered = canvas.answer(answers); !answered.ok()) return answered.error();
        queries += asked.size();
        std::fill(behind.begin(), behind.end(), std::uint8_t{0});
        for (std::size_t k = 0; k < asked.size(); ++k) behind[asked[k]] |= answers[k];
        for (std::size_t q = job.question_begin[j]; q < job.question_begin[j + 1]; ++q) hits[q] = behind[job.questions[q].prism];
    }
    return queries;
}

} // namespace trocar::collision
