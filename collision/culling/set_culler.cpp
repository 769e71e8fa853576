#include "collision/culling/set_culler.hpp"

#include <algorithm>
#include <numeric>

namespace trocar::collision {

void SetCuller::reserve(std::size_t prisms, std::size_t pairs, std::size_t sets) {
    const std::size_t live = std::min(prisms, 2 * pairs);
    view_.reserve(live, std::min(live * sets, 2 * pairs), sets); // a prism queries a set once
    place_.reserve(prisms);
    live_set_.reserve(live);
    asked_.reserve(live);
    entry_begin_.reserve(sets + 1);
    next_.reserve(sets);
    entries_.reserve(2 * pairs);
    entry_question_.reserve(2 * pairs);
}

void SetCuller::gather_live(const CullProblem& problem, std::span<const TrianglePair> pairs) {
    place_.assign(problem.prisms.size(), kNoIndex);
    for (const auto& [a, b] : pairs) place_[a] = place_[b] = 0;
    view_.prisms.clear();
    view_.corners.clear();
    live_set_.clear();
    for (Index p = 0; p < place_.size(); ++p) {
        if (place_[p] == kNoIndex) continue;
        place_[p] = static_cast<Index>(live_set_.size());
        view_.prisms.push_back(problem.prisms[p]);
        view_.corners.push_back(problem.corners[p]);
        live_set_.push_back(problem.set_of[p]);
    }
    auto& begin = view_.set_begin;
    begin.assign(problem.set_count + 1, 0);
    for (const Index set : live_set_) ++begin[set + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    view_.set_members.resize(live_set_.size());
    next_.assign(begin.begin(), begin.end() - 1);
    for (Index p = 0; p < live_set_.size(); ++p) view_.set_members[next_[live_set_[p]]++] = p;
}

/// Both ends of a pair query the other's set; repeated queries of a set are merged. Two counting passes, no sorting.
void SetCuller::gather_questions(std::span<const TrianglePair> pairs, Index set_count) {
    const auto asker = [&](std::size_t entry) { return place_[entry % 2 == 0 ? pairs[entry / 2].a : pairs[entry / 2].b]; };
    const auto set_asked = [&](std::size_t entry) { return live_set_[place_[entry % 2 == 0 ? pairs[entry / 2].b : pairs[entry / 2].a]]; };
    const std::size_t count = 2 * pairs.size();
    entry_begin_.assign(set_count + 1, 0);
    for (std::size_t e = 0; e < count; ++e) ++entry_begin_[set_asked(e) + 1];
    std::partial_sum(entry_begin_.begin(), entry_begin_.end(), entry_begin_.begin());
    entries_.resize(count);
    next_.assign(entry_begin_.begin(), entry_begin_.end() - 1);
    for (std::size_t e = 0; e < count; ++e) entries_[next_[set_asked(e)]++] = e;

    entry_question_.resize(count);
    asked_.assign(live_set_.size(), {kNoIndex, 0});
    view_.questions.clear();
    view_.question_begin.assign(1, 0);
    for (Index set = 0; set < set_count; ++set) {
        for (std::size_t k = entry_begin_[set]; k < entry_begin_[set + 1]; ++k) {
            const Index prism = asker(entries_[k]);
            if (asked_[prism].first != set) {
                asked_[prism] = {set, view_.questions.size()};
                view_.questions.push_back({prism, set});
            }
            entry_question_[entries_[k]] = asked_[prism].second;
        }
        view_.question_begin.push_back(view_.questions.size());
    }
}

Result<void> SetCuller::look(const CullProblem& problem, const ViewDirection& direction, const CullPlan& plan, CullBackend& backend,
                             std::vector<TrianglePair>& pairs, CullReport& report) {
    gather_live(problem, pairs);
    gather_questions(pairs, problem.set_count);
    const auto outcome = view_.look(
        direction, {.reach = problem.reach, .resolution = plan.resolution, .adapt = plan.adapt_resolution, .memory = plan.memory}, backend);
    if (!outcome.ok()) return outcome.error();
    report.resolution = report.views == 0 ? outcome->resolution : std::min(report.resolution, outcome->resolution);
    report.lowered_for_memory += outcome->lowered_for_memory;
    ++report.views;
    report.questions += view_.questions.size();
    report.drawn += view_.prisms.size();
    std::size_t kept = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (view_.hits[entry_question_[2 * i]] && view_.hits[entry_question_[2 * i + 1]]) pairs[kept++] = pairs[i];
    pairs.resize(kept);
    return {};
}

Result<CullReport> SetCuller::cull(const CullProblem& problem, const CullPlan& plan, CullBackend& backend,
                                   std::vector<TrianglePair>& pairs) {
    CullReport report;
    for (int round = 0; round < plan.max_rounds && !pairs.empty(); ++round) {
        const std::size_t before = pairs.size();
        ++report.rounds;
        for (int v = 0; v < (plan.reversed_views ? 6 : 3) && !pairs.empty(); ++v) {
            auto looked = look(problem, view_along_axis(v % 3, v >= 3), plan, backend, pairs, report);
            if (!looked.ok()) return looked.error();
        }
        if (static_cast<double>(before - pairs.size()) <= plan.worthwhile * static_cast<double>(before)) break;
    }
    return report;
}

} // namespace trocar::collision
