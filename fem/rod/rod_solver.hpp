// How the rods of one instrument are moved over a step: one interface, and what implements it. Another method is another class.
#pragma once

#include "fem/rod/rod.hpp"

#include <memory>

namespace trocar::fem {

/// One rod of a solve. All that it refers to outlives the call.
struct SolvedRod {
    const RodModel& model;
    RodState& state; // from the start of the step to its end
    const RodDrive& drive;
    std::span<RodPlane> planes; // half-spaces of the whole step; their forces are filled in
    RodWorkspace& workspace;
    RodReport& report;
    std::span<RodPlane> self = {}; // that places of the rod itself carry, of the implicit rod
    Index id = 0;                  // by which a RodMeeting names it
};

class RodSolver {
public:
    virtual ~RodSolver() = default;

    /// rods   the outermost first, each within the bore of the one before, as many as the solver was made for
    /// step   s
    /// fails  never; a state that is not finite is reported by node. Allocates nothing once every list has had its longest size.
    virtual void solve(std::span<const SolvedRod> rods, double step) noexcept = 0;
};

/// One rod, implicit (rod.hpp). Sub-steps, of two stages each, are no longer than twice kImplicitSubstep, so that its lagged frames stay
/// close.
[[nodiscard]] std::unique_ptr<RodSolver> make_implicit_solver();

/// A catheter and the wire in its bore, implicit, as one chain (coaxial.hpp).
/// plane_count   of both, that there is room for
[[nodiscard]] std::unique_ptr<RodSolver> make_coaxial_solver(const RodModel& outer, const RodModel& inner, std::size_t plane_count);

/// One rod as a chain of masses and springs, explicit (mass_spring.hpp).
/// substeps   of a step, from count_mass_spring_substeps
[[nodiscard]] std::unique_ptr<RodSolver> make_mass_spring_solver(unsigned substeps);

inline constexpr double kImplicitSubstep = 5e-3; // s
[[nodiscard]] unsigned count_substeps(double step) noexcept; // of kImplicitSubstep at most

} // namespace trocar::fem
