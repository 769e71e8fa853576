// A guide wire inside a catheter whose bore is not stated: two rods on one centre line where they overlap, the wire alone beyond the catheter's tip.
// bore_contact.hpp is the same with play.
//
// The catheter's nodes and the wire's nodes beyond its tip are one chain, solved as one rod: in the overlap it bends with the
// sum of both stiffnesses about the mean of both rest shapes, weighted by them. So neither a wire much stiffer than the
// catheter nor one much softer needs a shorter step. Along the axis both slide freely on each other: each has its own drive.
// Deviations: no play between wire and catheter; no friction between them; what presses along the axis on the wire's free end
// shortens the catheter, as both are one column to the vessel (part_tension tells who carries it); torsional wind-up, where the rods have torsion, is each rod's
// own, without force on the centre line and without friction torque.
#pragma once

#include "fem/rod/rod.hpp"
#include "fem/rod/rod_internal.hpp"

namespace trocar::fem {

/// One of the two. Both drives have the same port.
struct CoaxialRod {
    const RodModel& model;
    RodState& state;
    const RodDrive& drive;
    std::span<RodPlane> planes;
    RodWorkspace& workspace;
};

/// Scratch of the joint solve: grown in the first steps, reused afterwards.
struct CoaxialWorkspace {
    RodModel model; // of the chain: the outer rod's nodes, then the inner one's beyond its tip
    RodState state;
    std::vector<RodPlane> planes;
    std::vector<RodFlow> flow; // of the chain's nodes; empty without
    std::vector<Vec3> force;   // the same
    RodWorkspace rod;
};

/// Allocates for the longest chain and `plane_count` planes, so that steps allocate nothing.
void reserve_coaxial(const RodModel& outer, const RodModel& inner, std::size_t plane_count, CoaxialWorkspace& workspace);

/// First node of the inner rod that stands free beyond the outer one's tip; the inner one's node_count where none does.
[[nodiscard]] Index first_free_node(const RodModel& inner, double inner_insertion, double outer_insertion) noexcept;

/// As solve_rod for both at once. Where they overlap the inner rod's nodes lie on the outer one's axis.
/// returns  of the chain; the first bad node counts through the outer rod, then the free part of the inner one
RodReport solve_coaxial(const CoaxialRod& outer, const CoaxialRod& inner, double step, unsigned substeps,
                        CoaxialWorkspace& workspace) noexcept;

/// The joint chain knows the tension of both together; here each gets its own. Without friction in the bore the inner rod's is all along it what it is at
/// the bore's mouth; the rest is the outer one's. What pulls or weighs on the inner rod within the bore counts to the outer one's; one of which fewer
/// than three nodes stand out counts as in the bore.
void part_tension(const RodModel& outer, const RodState& outer_state, const RodModel& inner, const RodState& inner_state, RodInternalForces& outer_inside,
                  RodInternalForces& inner_inside) noexcept;

} // namespace trocar::fem
