// What one step leaves to the next, as bytes: everything that decides later bits, and nothing that the next step finds anew.
//
// Beside the State these are: contact springs and planes (the last step's answer, which the next integration feels), the modes and
// rates of the stable step, turns of link triangles that collapsed, radii of lumen balls that were measured, hints of the descent,
// forecasts by which the exact stage is started, pairs of leaves and spheres that are remembered, what a hand does. Left out are the
// clock's rates (they differ from run to run anyway), and trees and boxes, which are refitted before they are used.
#pragma once

#include "engine/step/context.hpp"

#include <string>
#include <string_view>

namespace trocar::engine {

/// Appends the memory, numbers in little-endian order.
void append_step_memory(const SceneModel& model, const State& state, const StepContext& context, std::string& bytes);

/// state, context   as made for this model (make_initial_state, make_step_context); half filled after an error
/// returns          empty, or what is wrong: too short or too long, sizes that are not this model's, an id out of range, a number that
///                  is not finite. Takes no more memory than a small multiple of the bytes.
[[nodiscard]] std::string read_step_memory(const SceneModel& model, std::string_view bytes, State& state, StepContext& context);

} // namespace trocar::engine
