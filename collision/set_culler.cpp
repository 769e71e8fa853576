#include "collision/set_culler.hpp"

#include <algorithm>
#include <numeric>

namespace seldinger::collision {

void SetCuller::gather_live(const CullProblem& problem, std::span<const TrianglePair> pairs) {
    place_.assign(problem.prisms.size(), kNoIndex);
    for (const auto& [a, b] : pairs) place_[a] = place_[b] = 0;
    live_.clear();
    live_prisms_.clear();
    live_corners_.clear();
    live_set_.clear();
    for (Index p = 0; p < place_.size(); ++p) {
        if (place_[p] == kNoIndex) continue;
        place_[p] = static_cast<Index>(live_.size());
        live_.push_back(p);
        live_prisms_.push_back(problem.prisms[p]);
        live_corners_.push_back(problem.corners[p]);
        live_set_.push_back(problem.set_of[p]);
    }
    set_begin_.assign(problem.set_count + 1, 0);
    for (const Index set : live_set_) ++set_begin_[set + 1];
    std::partial_sum(set_begin_.begin(), set_begin_.end(), set_begin_.begin());
    set_members_.resize(live_.size());
    std::vector<Index> next(set_begin_.begin(), set_begin_.end() - 1);
    for (Index p = 0; p < live_.size(); ++p) set_members_[next[live_set_[p]]++] = p;
}

/// Both ends of a pair ask for the other's set; who asks for a set twice asks once. Two counting passes, no sorting.
void SetCuller::gather_questions(std::span<const TrianglePair> pairs, Index set_count) {
    const auto asker = [&](std::size_t entry) { return place_[entry % 2 == 0 ? pairs[entry / 2].a : pairs[entry / 2].b]; };
    const auto set_asked = [&](std::size_t entry) { return live_set_[place_[entry % 2 == 0 ? pairs[entry / 2].b : pairs[entry / 2].a]]; };
    const std::size_t count = 2 * pairs.size();
    entry_begin_.assign(set_count + 1, 0);
    for (std::size_t e = 0; e < count; ++e) ++entry_begin_[set_asked(e) + 1];
    std::partial_sum(entry_begin_.begin(), entry_begin_.end(), entry_begin_.begin());
    entries_.resize(count);
    std::vector<std::size_t> next(entry_begin_.begin(), entry_begin_.end() - 1);
    for (std::size_t e = 0; e < count; ++e) entries_[next[set_asked(e)]++] = e;

    entry_question_.resize(count);
    asked_.assign(live_.size(), {kNoIndex, 0});
    questions_.clear();
    question_begin_.assign(1, 0);
    for (Index set = 0; set < set_count; ++set) {
        for (std::size_t k = entry_begin_[set]; k < entry_begin_[set + 1]; ++k) {
            const Index prism = asker(entries_[k]);
            if (asked_[prism].first != set) {
                asked_[prism] = {set, questions_.size()};
                questions_.push_back({prism, set});
            }
            entry_question_[entries_[k]] = asked_[prism].second;
        }
        question_begin_.push_back(questions_.size());
    }
}

Result<void> SetCuller::look(const CullProblem& problem, const ViewDirection& view, const CullPlan& plan, int resolution,
                             CullBackend& backend, std::vector<TrianglePair>& pairs, CullReport& report) {
    gather_live(problem, pairs);
    gather_questions(pairs, problem.set_count);
    footprints_.resize(live_.size());
    for (;; resolution /= 2) {
        const CullFrame frame = make_cull_frame(view, live_prisms_, problem.reach, resolution, resolution);
        for (std::size_t p = 0; p < live_.size(); ++p) footprints_[p] = make_footprint(frame, live_prisms_[p]);
        if (resolution < 2 || !plan.adapt_resolution || are_small_enough(footprints_, questions_)) break;
    }
    report.resolution = report.views == 0 ? resolution : std::min(report.resolution, resolution);
    hits_.assign(questions_.size(), 1);
    const CullJob job{.width = resolution,
                      .height = resolution,
                      .footprints = footprints_,
                      .corners = live_corners_,
                      .set_begin = set_begin_,
                      .set_members = set_members_,
                      .questions = questions_,
                      .question_begin = question_begin_,
                      .memory = plan.memory};
    auto done = backend.find_hits(job, hits_);
    if (!done.ok()) return done;
    ++report.views;
    report.questions += questions_.size();
    report.drawn += live_.size();
    std::size_t kept = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (hits_[entry_question_[2 * i]] && hits_[entry_question_[2 * i + 1]]) pairs[kept++] = pairs[i];
    pairs.resize(kept);
    return done;
}

Result<CullReport> SetCuller::cull(const CullProblem& problem, const CullPlan& plan, CullBackend& backend,
                                   std::vector<TrianglePair>& pairs) {
    CullReport report;
    const int resolution = std::clamp(plan.resolution > 0 ? plan.resolution : backend.preferred_resolution(), 1, kLargestPicture);
    for (int round = 0; round < plan.max_rounds && !pairs.empty(); ++round) {
        const std::size_t before = pairs.size();
        ++report.rounds;
        for (int v = 0; v < (plan.reversed_views ? 6 : 3) && !pairs.empty(); ++v) {
            auto looked = look(problem, view_along_axis(v % 3, v >= 3), plan, resolution, backend, pairs, report);
            if (!looked.ok()) return looked.error();
        }
        if (static_cast<double>(before - pairs.size()) <= plan.worthwhile * static_cast<double>(before)) break;
    }
    return report;
}

} // namespace seldinger::collision
