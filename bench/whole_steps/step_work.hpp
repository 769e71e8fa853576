// Bytes and arithmetic of the parts of a step whose loops are known: of the tissue's forces and of embedded surfaces. Counted from the model,
// every array once a pass; what is not counted here is unknown.
#pragma once

#include "engine/state/state.hpp"

#include <cstddef>
#include <optional>

namespace trocar::engine {

struct PartWork {
    double bytes = 0.0, flops = 0.0;
    std::size_t working_set = 0; // bytes, that a pass comes back to
};

/// Of the tissue's forces and node updates, for so many forces of a tetrahedron (StepReport::tet_evaluations); bodies of several laws count by
/// their sizes. Impulses between solids, springs and derivations of the stable step are not in it.
/// Nothing where a law's arithmetic was not counted, or there is no tissue.
[[nodiscard]] std::optional<PartWork> find_tissue_work(const SceneModel& model, std::uint64_t tet_evaluations);

/// Of the surfaces that the last step moved by their links, their frames alone where nothing looked at the surface.
/// Nothing where there are none.
[[nodiscard]] std::optional<PartWork> find_surface_work(const SceneModel& model, const State& state);

} // namespace trocar::engine
