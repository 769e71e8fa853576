// Where an instrument fits: clearance at entries and targets, and the place nearest to one that has enough of it.
#pragma once

#include "engine/prepare/model.hpp"
#include "engine/scene/scene.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

/// The place nearest to p in an inscribed sphere that leaves `radius` clear all round it, at rest. None where no sphere is that wide.
/// accepts   called with the nearest place of each sphere, nearest first; the first that passes is taken
[[nodiscard]] std::optional<Vec3> find_clear_place(const spheretree::LumenTree& lumen, const Vec3& p, double radius,
                                                      const std::function<bool(const Vec3&)>& accepts = {});

/// The instrument's cross-section at the port, and the part that is in at the start, must lie inside the lumen.
/// fails     with the nearest place where they do
[[nodiscard]] Result<void> check_entry(const Scene& scene, const SceneInstrument& spec, const InstrumentModel& model,
                                       const BodyModel& lumen);

/// The tip must be able to stand within the tolerance of the target that it follows.
/// fails     with the nearest place where it can
[[nodiscard]] Result<void> check_target(const Scene& scene, const SceneInstrument& spec, const InstrumentModel& model,
                                        const BodyModel& lumen, const Vec3& target);

/// Warnings on a target that is accepted: the tip cannot stand on it, or the tolerance is wider than the lumen.
[[nodiscard]] std::vector<std::string> note_target(const Scene& scene, const SceneInstrument& spec, const InstrumentModel& model,
                                                   const BodyModel& lumen, const Vec3& target);

} // namespace trocar::engine
