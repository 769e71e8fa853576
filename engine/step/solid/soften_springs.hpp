// Contact gives way before the tetrahedra beneath it would set the step.
//
// A spring of the scene's stiffness on light nodes, or with a long lever on a triangle that is pressed flat, oscillates faster than any
// tetrahedron does: thousands of sub-steps for one place. So all springs of a body may add no more than kMostAdded times the square of the
// tissue's own fastest frequency; what would is softened, on both bodies alike, so that what one receives the other still gives. It
// is counted (StepReport::softened): there solids go deeper into each other than the scene's stiffness says.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"

namespace trocar::engine {

/// [-]; contact may shorten the stable step by a factor of 5 = sqrt(1 + 24).
inline constexpr double kMostAdded = 24.0;

/// Softens the springs that push_solids has just made. A place whose spring may be stiffer than the last one was starts less deep, so that
/// what it holds is no more energy than before.
void soften_springs(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report);

} // namespace trocar::engine
