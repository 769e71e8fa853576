// How blood flows through a hollow body: along its centreline, split where vessels branch.
#pragma once

#include "base/vec.hpp"
#include "fem/embedding/links.hpp"
#include "spheretree/lumen/centreline.hpp"

#include <optional>
#include <span>
#include <vector>

namespace trocar::engine {

/// A tree of points along the vessels, parents before their children. Built once, then only read.
struct BloodFlow {
    std::vector<Vec3> points;             // [point_count] m, rest pose
    std::vector<double> radii;            // [point_count] m, of the lumen
    std::vector<double> speeds;           // [point_count] m/s, mean over the cross-section and over time
    std::vector<Index> parents;           // [point_count] upstream; kNoIndex: where the blood comes in
    std::vector<Index> child_begin;       // [point_count + 1]
    std::vector<Index> children;          // downstream
    std::optional<fem::RigidLinks> links; // it moves with the organ that carries the vessel

    [[nodiscard]] std::size_t point_count() const noexcept { return points.size(); }
    [[nodiscard]] std::span<const Index> children_of(Index point) const noexcept {
        return std::span(children).subspan(child_begin[point], child_begin[point + 1] - child_begin[point]);
    }
};

/// Every end of the tree but the root lets out blood in proportion to the cube of its radius; what passes a place is what comes
/// out beyond it. So flow is conserved, and a narrow place is a fast one.
/// speed     m/s, mean over the cross-section at the inlet
/// source    Murray 1926, "The physiological principle of minimum work": flow goes with the cube of the radius
[[nodiscard]] BloodFlow make_blood_flow(const spheretree::CentrelineTree& tree, double speed);

/// Where blood that flows along `direction` at the tree's root comes in: the end behind it; the root where nothing lies behind.
[[nodiscard]] Vec3 find_inflow(const spheretree::CentrelineTree& tree, const Vec3& direction);

/// The point at rest in whose cross-section p lies deepest.
[[nodiscard]] Index find_flow_point(const BloodFlow& flow, const Vec3& p) noexcept;
/// The same where the points stand now.
[[nodiscard]] Index find_flow_point(const BloodFlow& flow, const Vec3& p, std::span<const Vec3> points) noexcept;

} // namespace trocar::engine
