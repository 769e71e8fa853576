#include "fem/rod/rod_solver.hpp"

#include "fem/rod/coaxial.hpp"
#include "fem/rod/mass_spring.hpp"
#include "fem/rod/rod_stages.hpp"
#include "fem/rod/rod_step.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trocar::fem {

unsigned count_substeps(double step) noexcept { return std::max(1u, static_cast<unsigned>(std::ceil(step / kImplicitSubstep - 1e-9))); }

RodReport solve_rod(const RodModel& model, RodState& state, double step, unsigned substeps, const RodDrive& drive,
                    std::span<RodPlane> planes, RodWorkspace& work, std::span<RodPlane> self) noexcept {
    RodReport report;
    RodStages stages(model, state, drive, step, substeps, work);
    for (unsigned k = 0; k < 2 * substeps; ++k) {
        stages.begin(k);
        bool settled = true;
        const auto advance = [&](auto&& rod_step) {
            settled = rod_step.solve(report);
            if (k + 1 == 2 * substeps) rod_step.balance(report);
        };
        if (stages.twists())
            advance(RodStep<kTwistedCoordinates>(model, state, drive, planes, self, stages.dt(), stages.first(), stages.share(), work, &stages.twist()));
        else
            advance(RodStep<kRodCoordinates>(model, state, drive, planes, self, stages.dt(), stages.first(), stages.share(), work));
        stages.end(settled, planes, self, [](auto&&) {}, report);
    }
    stages.finish(report);
    return report;
}

namespace {

class ImplicitSolver final : public RodSolver {
public:
    void solve(std::span<const SolvedRod> rods, double step) noexcept override {
        assert(rods.size() == 1);
        const SolvedRod& rod = rods.front();
        rod.report = solve_rod(rod.model, rod.state, step, count_substeps(0.5 * step), rod.drive, rod.planes, rod.workspace, rod.self);
    }
};

class CoaxialSolver final : public RodSolver {
public:
    CoaxialSolver(const RodModel& outer, const RodModel& inner, std::size_t plane_count) {
        reserve_coaxial(outer, inner, plane_count, workspace_);
    }
    void solve(std::span<const SolvedRod> rods, double step) noexcept override {
        assert(rods.size() == 2);
        const SolvedRod &outer = rods[0], &inner = rods[1];
        outer.report = solve_coaxial({outer.model, outer.state, outer.drive, outer.planes, outer.workspace},
                                     {inner.model, inner.state, inner.drive, inner.planes, inner.workspace}, step, count_substeps(step),
                                     workspace_);
        inner.report = {}; // its energies are in the pair's
    }

private:
    CoaxialWorkspace workspace_;
};

class MassSpringSolver final : public RodSolver {
public:
    explicit MassSpringSolver(unsigned substeps) noexcept : substeps_(substeps) {}
    void solve(std::span<const SolvedRod> rods, double step) noexcept override {
        assert(rods.size() == 1);
        const SolvedRod& rod = rods.front();
        rod.report = solve_mass_spring(rod.model, rod.state, step, substeps_, rod.drive, rod.planes, rod.workspace);
    }

private:
    unsigned substeps_;
};

} // namespace

std::unique_ptr<RodSolver> make_implicit_solver() { return std::make_unique<ImplicitSolver>(); }

std::unique_ptr<RodSolver> make_coaxial_solver(const RodModel& outer, const RodModel& inner, std::size_t plane_count) {
    return std::make_unique<CoaxialSolver>(outer, inner, plane_count);
}

std::unique_ptr<RodSolver> make_mass_spring_solver(unsigned substeps) { return std::make_unique<MassSpringSolver>(substeps); }

} // namespace trocar::fem
