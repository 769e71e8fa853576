// Where two closed surfaces meet beneath pairs of leaf spheres: the places that push, at their true depth.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// Fills solids.touches from the leaf pairs of solids.coarse, and from those that stand for its open pairs
/// (probe_open_pairs): vertices of either body against the other's surface,
/// and the middles of what lies inside of edges that pierce it where no corner does. Contact::feature_a is a vertex or the
/// two of an edge, feature_b a triangle or, where edges cross (edge_touch.hpp), the other edge, the gap the signed distance of the place at the end of the step. Places outside are
/// listed as far as they may come in the next step (the margin and what they moved in this one), unless they pass by.
/// Inside is decided by winding numbers of the whole surface: a leaf alone does not know. Each place counts once, however
/// many leaf pairs see it. No allocation once the lists have their size.
///
/// All of it is on the budget's account: the surfaces' trees of two bodies, then leaf after leaf, those that touched in the last step
/// first. What there is no room for is left, counted (StepReport::left_pairs), and held by its spheres (hold_left.hpp); places that
/// pressed there go on where they are (carry_touch.hpp), which costs as much as there are of them.
void find_touches(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report, StepBudget& budget);

} // namespace trocar::engine
