#include "engine/step/tissue/waiting_springs.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/tissue/surface_spring.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Springs of solids among a body's: they were made one after another.
struct SpringRange {
    Index begin = kNoIndex, end = 0;
    void add(Index spring) noexcept {
        if (spring == kNoIndex) return;
        begin = std::min(begin, spring);
        end = std::max(end, spring + 1);
    }
    [[nodiscard]] bool empty() const noexcept { return begin >= end; }
};

SpringRange find_range(const SceneModel& model, std::size_t body, const State& state) noexcept {
    SpringRange range;
    for (const SpringPair& pair : state.solids.springs) {
        if (owner_of(model, pair.body_a) == body) range.add(pair.spring_a);
        if (owner_of(model, pair.body_b) == body) range.add(pair.spring_b);
    }
    return range;
}

/// m; of a pair's normal spring, what is left between the two places `time` s after it was made.
double find_pair_gap(const SceneModel& model, const SpringPair& pair, double time, const State& state) noexcept {
    double gap = 0.0;
    for (const auto& [body, spring] : {std::pair(pair.body_a, pair.spring_a), std::pair(pair.body_b, pair.spring_b)}) {
        if (spring == kNoIndex) continue;
        const std::size_t owner = owner_of(model, body);
        gap += fem::find_spring_gap(state.bodies[owner].springs, spring, time, state.bodies[owner].tissue.position);
    }
    return gap;
}

/// Is there a pair of this body that is pressed at that time?
bool is_pressed(const SceneModel& model, std::size_t body, double time, const State& state) noexcept {
    return std::any_of(state.solids.springs.begin(), state.solids.springs.end(), [&](const SpringPair& pair) {
        const bool is_own = (pair.spring_a != kNoIndex && owner_of(model, pair.body_a) == body) ||
                            (pair.spring_b != kNoIndex && owner_of(model, pair.body_b) == body);
        return is_own && find_pair_gap(model, pair, time, state) < 0.0;
    });
}

} // namespace

void choose_springs(const SceneModel& model, std::size_t body, const State& state, TissueScratch& scratch) {
    const SpringRange solids = find_range(model, body, state);
    scratch.springs_deferred = !solids.empty() && !is_pressed(model, body, 0.0, state);
    if (!scratch.springs_deferred) return;
    const std::vector<fem::ContactSpring>& all = state.bodies[body].springs.springs;
    std::vector<fem::ContactSpring>& others = scratch.other_springs.springs;
    others.assign(all.begin(), all.begin() + solids.begin);
    others.insert(others.end(), all.begin() + solids.end, all.end());
    scratch.other_springs.entries = state.bodies[body].springs.entries;
}

const fem::ContactSprings& active_springs(const BodyState& state, const TissueScratch& scratch) noexcept {
    return scratch.springs_deferred ? scratch.other_springs : state.springs;
}

bool has_met(const SceneModel& model, std::size_t body, const State& state) noexcept {
    return is_pressed(model, body, model.step_s, state);
}

} // namespace trocar::engine
