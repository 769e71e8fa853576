#include "collision/culling/query_culler.hpp"

#include "collision/culling/chromatic_sets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace trocar::collision {
namespace {

constexpr std::uint32_t kNeverSeen = std::numeric_limits<std::uint32_t>::max();

/// Extent along the axes, grown; one rounding each way is allowed for.
struct Extents {
    Vec3 low, high;
    explicit Extents(const SweptCorners& corners, double reach) : low(corners[0]), high(corners[0]) {
        for (const Vec3& p : corners) {
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
        }
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::nextafter(low[axis] - reach, -kInfinity);
            high[axis] = std::nextafter(high[axis] + reach, kInfinity);
        }
    }
};

/// Visits slots from the last to the first in pass 0, from the first to the last in pass 1.
template <class Visit>
void in_order(std::size_t count, int pass, Visit&& visit) {
    for (std::size_t k = 0; k < count; ++k) visit(pass == 0 ? count - 1 - k : k);
}

/// The sets of the live prisms alone.
ChromaticSets sets_of_live(const CullProblem& problem, std::span<const Index> live) {
    ChromaticSets sets;
    sets.begin.assign(problem.set_count + 1, 0);
    for (const Index prism : live) {
        sets.set_of.push_back(problem.set_of[prism]);
        ++sets.begin[problem.set_of[prism] + 1];
    }
    std::partial_sum(sets.begin.begin(), sets.begin.end(), sets.begin.begin());
    sets.members.resize(live.size());
    std::vector<Index> next(sets.begin.begin(), sets.begin.end() - 1);
    for (Index p = 0; p < live.size(); ++p) sets.members[next[sets.set_of[p]]++] = p;
    return sets;
}

} // namespace

void QueryCuller::note_seen(Index prism) {
    if (seen_now_[live_[prism]] == kNeverSeen) seen_now_[live_[prism]] = seen_count_++;
}

void QueryCuller::gather(const CullProblem& problem, const QueryPlan& plan, std::span<const TrianglePair> pairs) {
    std::vector<Index> place(problem.prisms.size(), kNoIndex);
    for (const auto& [a, b] : pairs) place[a] = place[b] = 0;
    live_.clear();
    prisms_.clear();
    std::vector<Triangle> corners;
    Index vertices = 0;
    for (Index p = 0; p < place.size(); ++p) {
        if (place[p] == kNoIndex) continue;
        place[p] = static_cast<Index>(live_.size());
        live_.push_back(p);
        prisms_.push_back(problem.prisms[p]);
        corners.push_back(problem.corners[p]);
        for (const Index v : problem.corners[p]) vertices = std::max(vertices, v + 1);
    }
    if (seen_before_.size() != problem.prisms.size()) seen_before_.assign(problem.prisms.size(), kNeverSeen);
    seen_now_.assign(problem.prisms.size(), kNeverSeen);
    seen_count_ = 0;

    const ChromaticSets sets = sets_of_live(problem, live_);
    const TriangleStars stars(corners, vertices);
    std::map<std::pair<Index, Index>, std::vector<std::size_t>> pairs_of; // of two sets, the lower first
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const Index a = problem.set_of[pairs[k].a], b = problem.set_of[pairs[k].b];
        pairs_of[{std::min(a, b), std::max(a, b)}].push_back(k);
    }
    set_pairs_.clear();
    std::vector<std::size_t> slot_of[2] = {std::vector<std::size_t>(live_.size()), std::vector<std::size_t>(live_.size())};
    const auto turn = [&](const SetSlot& slot) {
        std::uint32_t first = kNeverSeen;
        for (const Index prism : {slot.of_i, slot.of_j})
            if (prism != kNoIndex) first = std::min(first, seen_before_[live_[prism]]);
        return first;
    };
    for (const auto& [two, members] : pairs_of) {
        SetPair& set_pair = set_pairs_.emplace_back(SetPair{{two.first, two.second}, {}, {}});
        std::vector<SetSlot> order = pair_sets(sets, corners, stars, two.first, two.second);
        if (plan.temporal_order)
            std::stable_sort(order.begin(), order.end(), [&](const SetSlot& x, const SetSlot& y) { return turn(x) < turn(y); });
        for (const SetSlot& slot : order) {
            if (slot.of_i != kNoIndex) slot_of[0][slot.of_i] = set_pair.slots.size();
            if (slot.of_j != kNoIndex) slot_of[1][slot.of_j] = set_pair.slots.size();
            set_pair.slots.push_back({{slot.of_i, slot.of_j}, {}});
        }
        for (const std::size_t k : members) {
            const bool swapped = problem.set_of[pairs[k].a] != two.first;
            const Index first = place[swapped ? pairs[k].b : pairs[k].a], second = place[swapped ? pairs[k].a : pairs[k].b];
            set_pair.entries.push_back({k, {slot_of[0][first], slot_of[1][second]}});
        }
    }
    left_ = pairs.size();
    drop_free();
}

/// Takes out pairs of which one is free of the other's set, and finds the prisms that still have one.
void QueryCuller::drop_free() {
    for (SetPair& set_pair : set_pairs_) {
        const int second = set_pair.one_set() ? 0 : 1;
        const auto freedom = [&](const Entry& e, int side) -> Freedom& {
            return set_pair.slots[e.slots[side]].freedom[side == 0 ? 0 : second];
        };
        const std::size_t before = set_pair.entries.size();
        std::erase_if(set_pair.entries, [&](const Entry& e) { return freedom(e, 0).everywhere() || freedom(e, 1).everywhere(); });
        left_ -= before - set_pair.entries.size();
        for (Slot& slot : set_pair.slots)
            for (Freedom& f : slot.freedom) f.wanted = false;
        for (const Entry& e : set_pair.entries) freedom(e, 0).wanted = freedom(e, 1).wanted = true;
    }
}

/// The two passes along each axis, a running range of what came before in place of a depth buffer.
void QueryCuller::test_axes(double reach, QueryReport& report) {
    std::vector<Extents> extents;
    for (const SweptCorners& prism : prisms_) extents.emplace_back(prism, reach);
    for (SetPair& set_pair : set_pairs_)
        for (int side = 0; side < set_pair.sides(); ++side)
            for (int axis = 0; axis < 3; ++axis)
                for (int pass = 0; pass < 2; ++pass) {
                    const int other = set_pair.one_set() ? 0 : 1 - side;
                    double low = std::numeric_limits<double>::infinity(), high = -low;
                    in_order(set_pair.slots.size(), pass, [&](std::size_t k) {
                        Slot& slot = set_pair.slots[k];
                        Freedom& own = slot.freedom[side];
                        if (slot.prisms[side] != kNoIndex && own.wanted && !own.passes[pass]) {
                            const Extents& e = extents[slot.prisms[side]];
                            ++report.axis_tests;
                            own.passes[pass] = e.high[axis] < low || e.low[axis] > high;
                        }
                        if (slot.prisms[other] == kNoIndex || slot.freedom[other].need_not_be_drawn(pass)) return;
                        low = std::min(low, extents[slot.prisms[other]].low[axis]);
                        high = std::max(high, extents[slot.prisms[other]].high[axis]);
                    });
                }
    drop_free();
    report.left_after_axes = left_;
}

Result<void> QueryCuller::look(const QueryPlan& plan, const ViewDirection& direction, double reach, VisibilityCanvas& canvas,
                               QueryReport& report) {
    int resolution = std::clamp(plan.resolution > 0 ? plan.resolution : canvas.preferred_resolution(), 1, kLargestPicture);
    std::vector<Footprint> footprints(prisms_.size());
    for (;; resolution /= 2) {
        const CullFrame frame = make_cull_frame(direction, prisms_, reach, resolution, resolution);
        for (std::size_t p = 0; p < prisms_.size(); ++p) footprints[p] = make_footprint(frame, prisms_[p]);
        if (resolution < 2 || !plan.adapt_resolution || are_small_enough(footprints, {})) break;
    }
    report.resolution = report.views == 0 ? resolution : std::min(report.resolution, resolution);
    ++report.views;
    CullJob job;
    job.width = job.height = resolution;
    job.footprints = footprints;
    if (auto ready = canvas.start(job); !ready.ok()) return ready;

    std::vector<Asked> asked;
    std::vector<std::uint8_t> behind;
    for (int pass = 0; pass < 2; ++pass) { // answers of the first pass are known in the second
        asked.clear();
        for (std::size_t at = 0; at < set_pairs_.size(); ++at) {
            SetPair& set_pair = set_pairs_[at];
            for (int side = 0; side < set_pair.sides() && !set_pair.entries.empty(); ++side) {
                const int other = set_pair.one_set() ? 0 : 1 - side;
                canvas.clear();
                in_order(set_pair.slots.size(), pass, [&](std::size_t k) {
                    const Slot& slot = set_pair.slots[k];
                    const Freedom& own = slot.freedom[side];
                    if (slot.prisms[side] != kNoIndex && own.wanted && !(plan.view_coherence && own.passes[pass])) {
                        canvas.ask(slot.prisms[side]);
                        asked.push_back({at, k, side, pass});
                    }
                    if (slot.prisms[other] == kNoIndex || (plan.view_coherence && slot.freedom[other].need_not_be_drawn(pass))) return;
                    canvas.draw(slot.prisms[other]);
                    ++report.drawn;
                });
            }
        }
        if (auto answered = canvas.answer(behind); !answered.ok()) return answered;
        report.queries += asked.size();
        for (std::size_t q = 0; q < asked.size(); ++q) {
            if (behind[q]) continue;
            Slot& slot = set_pairs_[asked[q].set_pair].slots[asked[q].slot];
            slot.freedom[asked[q].side].passes[asked[q].pass] = true;
            note_seen(slot.prisms[asked[q].side]);
        }
    }
    drop_free();
    return {};
}

Result<QueryReport> QueryCuller::cull(const CullProblem& problem, const QueryPlan& plan, VisibilityCanvas& canvas,
                                      std::vector<TrianglePair>& pairs) {
    QueryReport report;
    gather(problem, plan, pairs);
    Result<void> looked;
    report.left_after_axes = pairs.size();
    if (plan.axis_tests) test_axes(problem.reach, report);
    for (int round = 0; round < plan.max_rounds && left_ > 0 && looked.ok(); ++round) {
        const std::size_t before = left_;
        ++report.rounds;
        for (int view = 0; view < plan.views && left_ > 0 && looked.ok(); ++view)
            looked = look(plan, view_along_axis(view % 3, view >= 3), problem.reach, canvas, report);
        if (left_ == before) break;
    }
    std::vector<std::uint8_t> kept(pairs.size(), 0);
    for (const SetPair& set_pair : set_pairs_)
        for (const Entry& entry : set_pair.entries) kept[entry.pair] = 1;
    std::size_t count = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k)
        if (kept[k]) pairs[count++] = pairs[k];
    pairs.resize(count);
    seen_before_.swap(seen_now_);
    if (!looked.ok()) return looked.error();
    return report;
}

} // namespace trocar::collision
