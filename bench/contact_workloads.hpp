// Moving meshes on which continuous contacts are measured: the shapes of the benchmark of Govindaraju et al. 2005, generated here.
#pragma once

#include "engine/io/frames.hpp"

namespace trocar::engine {

/// The whole fold, and which of its steps are wanted.
inline constexpr std::size_t kFoldSteps = 60;
struct FoldPart {
    std::size_t first = 0, steps = kFoldSteps;
};

/// Cloth of columns x rows squares, 1 cm each, that folds like an accordion with wrinkles until its pleats press into each other: free
/// in the first half of the fold, touching in the second. Motion and contacts per triangle do not depend on the number of columns.
[[nodiscard]] FrameSequence make_folding_cloth(std::size_t columns, std::size_t rows, const FoldPart& part = {});

/// A branching artery that bends and a catheter of 10,000 triangles that is pushed along its outer wall, dipping in and out of it.
/// cell   m, edge of the grid that the artery is cut from: 0.608e-3 gives about 83,000 triangles
[[nodiscard]] FrameSequence make_bending_artery(double cell, std::size_t steps);

} // namespace trocar::engine
