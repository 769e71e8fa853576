// The spheres of solid bodies in a step: of covering trees all at once from the surface's corners, of wrapped trees one by one from
// the coarse nodes, as somebody asks for them.
#pragma once

#include "engine/step/context.hpp"

namespace trocar::engine {

/// Sphere trees of solid bodies that something can touch follow their surfaces over the step, and as far again: a spring
/// is needed before the surfaces meet, which may be within the next step. With SphereTrees::Heuristic they follow as the paper's do,
/// and may lose some of their surface. Covering trees see motion relative to find_common_motion.
void update_solid_trees(const SceneModel& model, const State& state, StepContext& context);

/// False: nothing can touch the body, it has no spheres.
[[nodiscard]] bool has_spheres(const StepContext& context, std::size_t body) noexcept;

[[nodiscard]] spheretree::SolidView view_solid(const SceneModel& model, std::size_t body, StepContext& context) noexcept;

/// As its own mean motion sees it: a body that flies as a whole does not come near itself. Of one that touches itself.
[[nodiscard]] spheretree::SolidView view_self(const SceneModel& model, std::size_t body, StepContext& context) noexcept;

/// Found first where nobody asked before in this step.
[[nodiscard]] const spheretree::Sphere& sphere_of(std::size_t body, Index sphere, StepContext& context) noexcept;

/// Null where the tree is wrapped and the step did not look at the sphere.
[[nodiscard]] const spheretree::Sphere* known_sphere(std::size_t body, Index sphere, const StepContext& context) noexcept;

/// A' - A of the frames that the body hangs on, as its surface stands: where the next step starts from.
void keep_turns(const SceneModel& model, std::size_t body, const State& state, StepContext& context);

} // namespace trocar::engine
