// Named repairs that a scene may ask for. Each does one thing, says what it did in counts and what the surface measured before and
// after, and fails with an Error where the surface gives it nothing to work with, or where it would take more of the surface
// than it may. None runs unasked.
#pragma once

#include "base/mesh.hpp"
#include "base/repair_types.hpp"
#include "base/result.hpp"

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace trocar {

/// As scenes spell it: weld, drop_degenerate, drop_duplicates, drop_non_manifold, fill_holes, orient, drop_inner_shells,
/// keep_largest, drop_self_intersections.
[[nodiscard]] std::string_view repair_name(Repair repair) noexcept;
[[nodiscard]] std::optional<Repair> find_repair(std::string_view name) noexcept;
[[nodiscard]] std::span<const std::string_view> repair_names() noexcept;

[[nodiscard]] SurfaceMeasure measure_surface(const TriMesh& mesh);

/// "area 152000 to 153000 mm^2, volume open to 1.7e+06 mm^3, components 1"; each number once where it stayed.
[[nodiscard]] std::string describe_change(const SurfaceMeasure& before, const SurfaceMeasure& after);

/// In the order given. On an Error the mesh is left as it was. BadMesh as well, with what it would have removed, where a repair
/// takes more than options.may_remove of the area or of the volume, or leaves more components than it found. Left out of the
/// count: copies (drop_duplicates) and what lies inside what stays (drop_inner_shells).
[[nodiscard]] Result<RepairReport> apply_repairs(TriMesh& mesh, std::span<const Repair> repairs, const RepairOptions& options = {});

[[nodiscard]] Result<RepairStep> apply_repair(TriMesh& mesh, Repair repair, const RepairOptions& options = {});

} // namespace trocar
