// The spheres of solid bodies in a step: of covering trees all at once from the surface's corners, of wrapped trees one by one from
// the coarse nodes, as somebody asks for them.
#pragma once

#include "engine/step/solid/solid_scratch.hpp"

namespace trocar::engine {

/// Sphere trees of solid bodies that something can touch follow their surfaces over the step, and as far again: a spring
/// is needed before the surfaces meet, which may be within the next step. With SphereTrees::Heuristic they follow as the paper's do,
/// and may lose some of their surface. gravity: m/s^2, in this step. Covering trees see motion relative to find_common_motion.
/// starts   no step was done: the mean velocity that tissue is thrown with counts as what its next step is known to differ by
void update_solid_trees(const SceneModel& model, const State& state, const std::optional<Vec3>& gravity, SolidScratch& solids,
                        bool starts = false);

/// False: nothing can touch the body, it has no spheres.
[[nodiscard]] bool has_spheres(const SolidScratch& solids, std::size_t body) noexcept;

[[nodiscard]] spheretree::SolidView view_solid(const SceneModel& model, std::size_t body, SolidScratch& solids) noexcept;

/// As its own mean motion sees it: a body that flies as a whole does not come near itself. Of one that touches itself.
[[nodiscard]] spheretree::SolidView view_self(const SceneModel& model, std::size_t body, SolidScratch& solids) noexcept;

/// Found first where nobody asked before in this step.
[[nodiscard]] const spheretree::Sphere& sphere_of(std::size_t body, Index sphere, SolidScratch& solids) noexcept;

/// Null where the tree is wrapped and the step did not look at the sphere.
[[nodiscard]] const spheretree::Sphere* known_sphere(std::size_t body, Index sphere, const SolidScratch& solids) noexcept;

/// A' - A of the frames that each body with a wrapped tree hangs on, as its surface stands: where the step starts from.
void keep_turns(const SceneModel& model, const State& state, SolidScratch& solids);

} // namespace trocar::engine
