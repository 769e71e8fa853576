// A State as bytes, numbers in little-endian order, and back: what visit_state.hpp lists.
#pragma once

#include "base/result.hpp"
#include "engine/state/state.hpp"

#include <string>
#include <string_view>

namespace trocar::engine {

/// Appends the state, its surfaces evaluated (BodyState::surface_deferred is false).
void append_state(const State& state, std::string& bytes);

/// fails   BadValue: too short or too long, sizes that are not this model's, an id out of range, a number that is not finite. Takes no more
///         memory than a small multiple of the bytes.
[[nodiscard]] Result<State> read_state(const SceneModel& model, std::string_view bytes);

/// Is this a state of this model? Empty, or what does not fit.
[[nodiscard]] std::string find_misfit(const SceneModel& model, const State& state);

/// 64-bit FNV-1a over append_state's bytes: everything that decides later bits.
[[nodiscard]] std::uint64_t hash_whole_state(const State& state);

} // namespace trocar::engine
