// The matrix of implicit steps (implicit.hpp) at rest, factored: the preconditioner of all of a body's steps.
// Its columns are what the tissue's own product kernel makes of unit vectors, many of them at once, where no two have a neighbour in common.
// This work is based on: Curtis, Powell & Reid 1974 (columns by groups).
#pragma once

#include "base/result.hpp"
#include "fem/tissue/block_factor.hpp"
#include "fem/tissue/ties.hpp"
#include "fem/tissue/tissue.hpp"

namespace trocar::fem {

/// 1 - 1/sqrt(2): what a stage's implicit Euler has of a sub-step.
inline constexpr double kStageShare = 0.29289321881345254;

/// Beyond this a factor would take minutes and gigabytes.
inline constexpr std::size_t kMostImplicitNodes = 20000;

/// What all steps of a body are solved with: prepared once, only read.
struct ImplicitSystem {
    BlockFactor factor;       // A at rest
    double edge = 0.0;        // m, of a regular tetrahedron of the mean volume
};

/// What ties add to a body's matrix: the stiffness of its own end, as if the other were fixed.
struct TieLoad {
    std::span<const Tie> ties;
    bool hosts = false; // of the body whose tetrahedra the points lie in, not of the nodes
};

/// step: s, of one sub-step. Fails with BadValue where the body has more than kMostImplicitNodes.
[[nodiscard]] Result<ImplicitSystem> make_implicit_system(const TissueModel& model, double step, std::span<const TieLoad> ties = {});

} // namespace trocar::fem
