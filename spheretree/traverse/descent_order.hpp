// In which order a descent through pairs of spheres goes.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace trocar::spheretree {

/// In which order open pairs are refined. Breadth and Deepest keep every promise of Descent; the other two are baselines of
/// the sphere-tree paper (its figure 5): interrupted, they leave some pairs at their coarsest while others are finished.
enum class DescentOrder : std::uint8_t {
    Breadth,     // the sphere-tree paper's: first in, first out
    Deepest,     // round by round like Breadth, within a round those whose parents lie deepest in one another first
    Depth,       // last in, first out
    DepthCapped, // the same, and spheres on level `cap` count as leaves
};

/// breadth, deepest, depth, depth-capped.
[[nodiscard]] std::string_view order_name(DescentOrder order) noexcept;
[[nodiscard]] std::optional<DescentOrder> find_order(std::string_view name) noexcept;

} // namespace trocar::spheretree
