// Every member of every struct that a SceneModel is made of: one line each, so that whoever goes through a model leaves nothing out.
// A member that a struct gains and its line lacks is a compile error here (a structured binding names all or none): add it.
#pragma once

#include "base/aggregate.hpp"
#include "engine/prepare/model.hpp"

#include <concepts>
#include <string_view>
#include <tuple>
#include <type_traits>

namespace trocar::engine {

/// members_of(value): a tuple of references to all members; member_names(value): their names, with commas between.
#define TROCAR_MEMBERS(Type, ...)                                                                                                          \
    [[nodiscard]] inline auto members_of(const Type& whole) noexcept {                                                                     \
        const auto& [__VA_ARGS__] = whole;                                                                                                 \
        return std::tie(__VA_ARGS__);                                                                                                      \
    }                                                                                                                                      \
    [[nodiscard]] inline auto members_of(Type& whole) noexcept {                                                                           \
        auto& [__VA_ARGS__] = whole;                                                                                                       \
        return std::tie(__VA_ARGS__);                                                                                                      \
    }                                                                                                                                      \
    [[nodiscard]] constexpr std::string_view member_names(const Type*) noexcept { return #__VA_ARGS__; }

TROCAR_MEMBERS(TriMesh, vertices, triangles)
TROCAR_MEMBERS(SinCos, sin, cos)
TROCAR_MEMBERS(fem::LawConstants, mu, lambda, rest_volume, c10, c01, ogden_mu, ogden_alpha, ogden_terms, k1, k2, kappa, fibre_limit, patch, bend)
TROCAR_MEMBERS(fem::TetShape, inverse, volume, stiffness)
TROCAR_MEMBERS(fem::TetBatch, inverse, volume, gram, inverse_det, node, slot)
TROCAR_MEMBERS(fem::PatchShares, share)
TROCAR_MEMBERS(fem::PrismBatch, mean, bend, side)
TROCAR_MEMBERS(fem::PairBatch, along, shear, hold, kink, volume)
TROCAR_MEMBERS(fem::FibreBatch, axis)
TROCAR_MEMBERS(fem::ForceChunk, first_batch, batch_count, first_slot, slot_count)
TROCAR_MEMBERS(fem::ForcePlan, batches, chunks, shares, prisms, pairs, fibres, tet_of, node_of, record_of, slot_begin, slots, inv_mass)
TROCAR_MEMBERS(fem::TissueModel, material, law, tet_nodes, tet_shape, node_mass, inv_mass, rest_position, pinned, plan, volume, mass)
TROCAR_MEMBERS(fem::BlockFactor, order, column_begin, row, below, inverse)
TROCAR_MEMBERS(fem::ImplicitSystem, factor, edge)
TROCAR_MEMBERS(fem::RigidLinks, frame_nodes, frame_rest, vertex_frame, vertex_weight, vertex_projection, vertex_blend, node_rest,
               affine_nodes, affine_weight, degenerate, static_count, max_length, longest, long_count)
TROCAR_MEMBERS(fem::ProfileRow, from_tip, factor)
TROCAR_MEMBERS(fem::TipArc, length, angle, plane)
TROCAR_MEMBERS(fem::RodModel, design, segment, bend_stiffness, stretch_stiffness, mass, rest_curvature, twist_stiffness, turn_inertia,
               friction_share, rest_length, unit_edge_stiffness)
TROCAR_MEMBERS(fem::RodSkin, triangles, vertex_node, sides, turn)
TROCAR_MEMBERS(fem::RodPort, position, direction)
TROCAR_MEMBERS(collision::SurfaceTopology, triangles, edges, triangle_edges, vertex_owner, edge_owner)
TROCAR_MEMBERS(spheretree::Sphere, centre, radius)
TROCAR_MEMBERS(spheretree::SphereTree, spheres, parent, first_child, child_count, level, level_begin, items, item_begin, item_end)
TROCAR_MEMBERS(spheretree::CoveringTree, tree, vertex_begin, vertices)
TROCAR_MEMBERS(spheretree::ChainTree, tree)
TROCAR_MEMBERS(spheretree::DeformingTree::Beneath, frame, reach)
TROCAR_MEMBERS(spheretree::DeformingTree, tree, frame_rest, frame_nodes, affine_nodes, affine_reach, node_rest, near_begin, near, turners, beneath_begin, beneath,
               stands)
TROCAR_MEMBERS(spheretree::LumenTree, tree, largest_ball, leaf_of_ball, neighbour_begin, neighbours, wall_begin, wall_triangles,
               anchor_begin, anchors, anchor_weights, link_reach, rest_vertices, triangles)
TROCAR_MEMBERS(MotionRow, time, displacement)
TROCAR_MEMBERS(BloodFlow, points, radii, speeds, parents, child_begin, children, links)
TROCAR_MEMBERS(LoadRow, time, value)
TROCAR_MEMBERS(HeldNodes, pinned, moves, turns, point, axis)
TROCAR_MEMBERS(BodyLoad, kind, vector, number, over, nodes, share, faces, area)
TROCAR_MEMBERS(fem::Tie, node, host, weight, stiffness)
TROCAR_MEMBERS(WallJoint, host, ties)
TROCAR_MEMBERS(BodyModel, name, motion, surface, hollow, is_free_space, closed, tissue, implicit, host_body, links, joint, tied, self_contact, path, held, loads, node_give,
               velocity, spin, topology, sharp_edges, pulse_reach,
               covering, wrapped, lumen, blood)
TROCAR_MEMBERS(DriveRow, time, insertion, rotation)
TROCAR_MEMBERS(Route, points, radii, length)
TROCAR_MEMBERS(TipHold, slides, spins, rotation, moves, turns, point, axis)
TROCAR_MEMBERS(InstrumentModel, name, rod, skin, port, lumen, mass_spring_substeps, inside, play, wire, loose_wire, self_contact, detachable, waits_for, friction, inserted, tip_force, tip_torque, tip_over, tip_hold, limits, path,
               route, route_links, follow, flow_entry, chain, topology)
TROCAR_MEMBERS(EffectSet, elasticity, coarse_contact, self_contact, instrument_contact, loads, exact_contact, gravity, breathing, pulse, blood_drag, added)
TROCAR_MEMBERS(AddedEffect, effect, settings)
TROCAR_MEMBERS(BudgetLimits, mode, wall_s, work_units)
TROCAR_MEMBERS(SceneModel, name, file, step_s, step_count, fixed_substeps, max_substeps, integrator, budget, budget_covers_step, drop,
               bodies, nested, instruments, effects, contact, packing)

#undef TROCAR_MEMBERS

/// Structs that a scene's description names (engine/scene/described.hpp) are gone through as they are declared.
template <class T, class... Known>
concept OneOf = (std::same_as<std::remove_const_t<T>, Known> || ...);
template <class T>
concept DescribedSettings =
    OneOf<T, ContactSpec, PackingSpec, BreathingSpec, PulseSpec, Blood, DriveLimits, FollowSettings, fem::Material, fem::RodDesign>;
template <DescribedSettings T>
[[nodiscard]] auto members_of(T& value) noexcept {
    return tie_members(value);
}
[[nodiscard]] constexpr std::string_view member_names(const DescribedSettings auto*) noexcept { return {}; }

} // namespace trocar::engine
