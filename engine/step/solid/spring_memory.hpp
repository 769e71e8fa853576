// What the springs of touching vertices hold goes over from step to step: each step makes new springs, along new normals and to new
// closest points, and none of them may start with energy that nothing has brought.
//
// A spring follows its nodes linearly, the surface does not quite; a vertex may come in where no spring waited for it; a closest point
// may jump. Springs that started with the full depth would give back more than went in, each time, and what is pressed hard between
// stiff springs would heat until it bursts. So a spring starts as the last one ended, and no deeper than its place lies. What it lacks
// it gets at a speed at which nothing is thrown (kSettling).
// cost     the entries of the last response's springs, once
#pragma once

#include "engine/step/solid/solid_scratch.hpp"

namespace trocar::engine {

/// m/s; how fast a spring grows to the depth of a vertex that came in unopposed. Slower and what lands rests too deep for a while (a
/// millimetre for a second); faster and flesh crushed flat between solids, whose places come and go, is heated by the force times this.
inline constexpr double kSettling = 1e-3;

/// Notes what the vertices' springs of the last response hold at the step's end, and forgets whose they were.
void note_held(const SceneModel& model, State& state, SolidScratch& solids);

/// Of the last response; nullptr: no spring waited for it, or it is no vertex.
[[nodiscard]] const WarmStartSpring* find_warm_spring(const SolidScratch& solids, const Contact& touch) noexcept;
[[nodiscard]] const WarmStartSpring* find_warm_spring(const SolidScratch& solids,
                                             const std::tuple<std::size_t, std::size_t, Index>& key) noexcept;

/// m, <= 0; the gap that the springs of a place start with. Of vertices that are in what they held, and a little more, up to their depth.
[[nodiscard]] double find_start_gap(const SceneModel& model, const SolidScratch& solids, const Contact& touch) noexcept;

/// Remembers the springs that were just made for a touch with this gap; nullptr: it is no vertex's. sort_memory once all are made.
WarmStartSpring* store_warm_spring(const Contact& touch, double gap, SolidContactState& solids);
void sort_memory(SolidContactState& solids);

} // namespace trocar::engine
