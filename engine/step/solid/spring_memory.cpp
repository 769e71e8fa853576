#include "engine/step/solid/spring_memory.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/tissue/surface_spring.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

bool is_of_vertex(const Contact& touch) noexcept { return touch.feature_a[1] == kNoIndex; }

} // namespace

void note_held(const SceneModel& model, State& state, SolidScratch& solids) {
    std::swap(state.solids.vertex_springs, solids.vertex_springs_before);
    state.solids.vertex_springs.clear();
    const auto gap_of = [&](std::size_t body, Index spring) {
        const std::size_t owner = owner_of(model, body);
        if (spring == kNoIndex) return 0.0;
        return fem::find_spring_gap(state.bodies[owner].springs, spring, model.step_s, state.bodies[owner].tissue.position);
    };
    for (WarmStartSpring& place : solids.vertex_springs_before) // each body closes its share of the gap: the rest of it is the sum
        place.held = std::max(0.0, -(gap_of(place.own, place.spring_a) + gap_of(place.other, place.spring_b)));
}

const WarmStartSpring* find_warm_spring(const SolidScratch& solids, const Contact& touch) noexcept {
    return is_of_vertex(touch) ? find_warm_spring(solids, {touch.body_a, touch.body_b, touch.feature_a[0]}) : nullptr;
}

const WarmStartSpring* find_warm_spring(const SolidScratch& solids, const std::tuple<std::size_t, std::size_t, Index>& key) noexcept {
    const auto place = std::lower_bound(solids.vertex_springs_before.begin(), solids.vertex_springs_before.end(), key,
                                        [](const WarmStartSpring& x, const auto& wanted) { return x.key() < wanted; });
    return place != solids.vertex_springs_before.end() && place->key() == key ? &*place : nullptr;
}

double find_start_gap(const SceneModel& model, const SolidScratch& solids, const Contact& touch) noexcept {
    if (!(touch.gap < 0.0) || !is_of_vertex(touch)) return touch.gap;
    const WarmStartSpring* before = find_warm_spring(solids, touch);
    return std::max(touch.gap, -((before ? before->held : 0.0) + kSettling * model.step_s));
}

WarmStartSpring* store_warm_spring(const Contact& touch, double gap, SolidContactState& solids) {
    if (!is_of_vertex(touch)) return nullptr;
    const SpringPair& made = solids.springs.back();
    return &solids.vertex_springs.emplace_back(
        WarmStartSpring{touch.body_a, touch.body_b, touch.feature_a[0], made.spring_a, made.spring_b, std::max(0.0, -gap)});
}

void sort_memory(SolidContactState& solids) {
    std::sort(solids.vertex_springs.begin(), solids.vertex_springs.end(), [](const WarmStartSpring& x, const WarmStartSpring& y) { return x.key() < y.key(); });
}

} // namespace trocar::engine
