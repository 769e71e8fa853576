#include "engine/step/solid/solid_probe.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/solid/touch_rules.hpp"

#include <algorithm>
#include <tuple>

namespace trocar::engine {

namespace {

bool same_bodies(const LeafPair& x, const LeafPair& y) { return x.a == y.a && x.b == y.b; }

/// Bodies with open pairs whose depth the surfaces decide, each once.
void list_open_bodies(const SceneModel& model, SolidScratch& solids) {
    std::vector<std::pair<Index, Index>>& open = solids.open_bodies;
    open.clear();
    for (const Contact& contact : solids.coarse) {
        if (contact.origin != ContactOrigin::AssumedSpheres) continue;
        if (!is_between_bodies(contact)) continue;
        if (contact.a == contact.b) continue;                                               // not looked for
        const std::pair<Index, Index> bodies = bodies_of(contact);
        if (!open.empty() && open.back() == bodies) continue;
        if (meet_by_surface(model, bodies.first, bodies.second)) open.push_back(bodies);
    }
    std::sort(open.begin(), open.end());
    open.erase(std::unique(open.begin(), open.end()), open.end());
}

bool later(const ProbedSphere& x, const ProbedSphere& y) { return std::tie(x.bound, x.sphere) > std::tie(y.bound, y.sphere); }

/// One body's leaves against the other's surface, nearest or deepest first.
struct Probe {
    const SceneModel& model;
    SolidScratch& solids;
    StepReport& report;
    std::size_t own, other;
    std::size_t tests_left;
    SurfaceAccount& account;
    bool complete = true; // the budget did not end it

    /// No place beneath the sphere has a signed distance below distance(centre) - radius: it changes by no more than the way.
    void look_at(Index sphere) {
        const spheretree::Sphere& bound = sphere_of(own, sphere, solids);
        if (bound.radius < 0.0 || tests_left == 0 || !complete) return;
        complete = account.take(kUnitsPerQuery);
        if (!complete) return;
        --tests_left;
        ++report.probe_tests;
        const InsideTest& against = solids.bodies[other].inside;
        const auto hit = against.tree().closest(bound.centre);
        if (!hit) return;
        const double distance = against.inside(bound.centre) ? -hit->distance : hit->distance;
        if (distance - bound.radius > model.contact.margin) return;
        solids.heap.push_back({distance - bound.radius, sphere, hit->triangle});
        std::push_heap(solids.heap.begin(), solids.heap.end(), later);
    }

    [[nodiscard]] bool run() {
        std::vector<ProbedSphere>& heap = solids.heap;
        const spheretree::SphereTree& tree = model.bodies[own].covering.tree;
        heap.clear();
        if (tree.sphere_count() > 0) look_at(0);
        for (std::size_t leaves = 0; !heap.empty() && leaves < kProbedLeaves;) {
            std::pop_heap(heap.begin(), heap.end(), later);
            const ProbedSphere next = heap.back();
            heap.pop_back();
            for (Index c = 0; c < tree.child_count[next.sphere]; ++c) look_at(tree.first_child[next.sphere] + c);
            if (!tree.is_leaf(next.sphere)) continue;
            ++leaves;
            const Index facing = solids.bodies[other].leaf_of_triangle[next.triangle];
            solids.leaf_pairs.push_back(own < other ? LeafPair{own, other, next.sphere, facing}
                                                            : LeafPair{other, own, facing, next.sphere});
        }
        return complete;
    }
};

} // namespace

void probe_open_pairs(const SceneModel& model, SolidScratch& solids, StepReport& report, SurfaceAccount& account) {
    list_open_bodies(model, solids);
    for (const LeafPair& pair : solids.touching_before)
        if (pair.a == pair.b || std::binary_search(solids.open_bodies.begin(), solids.open_bodies.end(),
                                                   std::pair{static_cast<Index>(pair.a), static_cast<Index>(pair.b)}))
            solids.leaf_pairs.push_back(pair);
    if (solids.open_bodies.empty()) return;
    const std::size_t share = std::max(kLeastProbes, kProbeTests / (2 * solids.open_bodies.size()));
    for (const auto& bodies : solids.open_bodies) {
        const auto at = std::lower_bound(solids.meeting.begin(), solids.meeting.end(), bodies) - solids.meeting.begin();
        if (solids.looked[static_cast<std::size_t>(at)] == 0) continue;
        const auto [a, b] = bodies;
        const auto pair = std::lower_bound(solids.touching_before.begin(), solids.touching_before.end(), LeafPair{a, b}, kByKey);
        // what touched is worth more than what may lie deepest: a query for the latter, from the middle of a body, takes twenty for a vertex
        const bool touched = pair != solids.touching_before.end() && pair->a == a && pair->b == b;
        const bool of_a = !touched && Probe{model, solids, report, a, b, share, account}.run();
        if (!(of_a && Probe{model, solids, report, b, a, share, account}.run())) solids.left_bodies.push_back(bodies);
    }
}

void keep_touching(const SolidScratch& solids, std::vector<LeafPair>& kept) {
    kept.clear();
    const std::vector<LeafPair>& pairs = solids.done_pairs;
    for (std::size_t begin = 0; begin < pairs.size();) {
        const std::size_t first = kept.size();
        std::size_t end = begin;
        for (; end < pairs.size() && same_bodies(pairs[end], pairs[begin]); ++end)
            if (pairs[end].gap < std::numeric_limits<double>::infinity()) kept.push_back(pairs[end]);
        begin = end;
        if (kept.size() - first <= kPersistentPairs) continue;
        std::sort(kept.begin() + static_cast<std::ptrdiff_t>(first), kept.end(),
                  [](const LeafPair& x, const LeafPair& y) { return x.gap != y.gap ? x.gap < y.gap : x.key() < y.key(); });
        kept.resize(first + kPersistentPairs);
    }
    for (const LeafPair& pair : solids.touching_before) {
        if (std::binary_search(solids.left_pairs.begin(), solids.left_pairs.end(), pair, kByKey)) kept.push_back(pair);
        const auto at = std::lower_bound(solids.meeting.begin(), solids.meeting.end(), std::pair{static_cast<Index>(pair.a), static_cast<Index>(pair.b)});
        const bool meets = at != solids.meeting.end() && at->first == pair.a && at->second == pair.b;
        if (meets && solids.looked[static_cast<std::size_t>(at - solids.meeting.begin())] == 0) kept.push_back(pair);
    }
    std::sort(kept.begin(), kept.end(), kByKey);
    kept.erase(std::unique(kept.begin(), kept.end(), [](const LeafPair& x, const LeafPair& y) { return x.key() == y.key(); }), kept.end());
    for (LeafPair& pair : kept) pair.gap = std::numeric_limits<double>::infinity();
}

} // namespace trocar::engine
