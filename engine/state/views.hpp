// What programs see of a model and of a state, whose members are the engine's own: names, counts, and positions as spans.
#pragma once

#include "base/vec.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace trocar::engine {

struct SceneModel;
struct State;

/// All that a step leaves for the next, kept: a fork restored from it goes on to the same bits.
using SavedState = std::shared_ptr<const State>;

[[nodiscard]] std::size_t count_bodies(const SceneModel& model) noexcept;
[[nodiscard]] std::size_t count_instruments(const SceneModel& model) noexcept;
/// Nothing where there is none of that name.
[[nodiscard]] std::optional<std::size_t> find_body(const SceneModel& model, std::string_view name) noexcept;
[[nodiscard]] std::optional<std::size_t> find_instrument(const SceneModel& model, std::string_view name) noexcept;

/// Spans that hold until the state or the model changes or goes.
struct BodyView {
    std::string_view name;
    std::span<const Vec3> surface;       // [vertex_count] m, at the end of the last step
    std::span<const Triangle> triangles; // [triangle_count]
    std::span<const Vec3> nodes;         // [node_count] m, of its tissue; empty: it does not deform
    std::span<const Vec3> node_velocity; // [node_count] m/s
};

/// Likewise.
struct InstrumentView {
    std::string_view name;
    std::span<const Vec3> rod;            // [node_count] m, from the handle's end to the tip
    std::span<const Vec3> rod_velocity;   // [node_count] m/s
    std::span<const Vec3> skin;           // [skin vertex_count] m, at the end of the last step
    std::span<const Triangle> skin_triangles;
    double insertion = 0.0; // m of rod beyond the port
    double rotation = 0.0;  // rad of the handle about the rod's axis

    [[nodiscard]] const Vec3& tip() const noexcept { return rod.back(); }
};

/// body, instrument   below their counts
[[nodiscard]] BodyView view_body(const SceneModel& model, const State& state, std::size_t body) noexcept;
[[nodiscard]] InstrumentView view_instrument(const SceneModel& model, const State& state, std::size_t instrument) noexcept;

/// 64-bit FNV-1a over the bits of step, positions, velocities, insertions and rotations, in the order of the structs: where everything is,
/// what summary.json and the stored references name. hash_whole_state (state_bytes.hpp) covers all that decides later bits.
[[nodiscard]] std::uint64_t hash_state(const State& state) noexcept;

} // namespace trocar::engine
