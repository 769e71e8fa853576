// What the parts of the scene reader share. Each reads a checked object into its struct and finds the mistakes that a
// table cannot: names that point nowhere, values that contradict each other.
#pragma once

#include "engine/scene/check.hpp"
#include "engine/scene/scene.hpp"
#include "engine/scene/values.hpp"

#include <optional>
#include <string>

namespace trocar::engine {

/// [-] a path or a speed that keeps a limit exactly, as written in decimals, must not fail by rounding.
inline constexpr double kLimitTolerance = 1e-9;

/// What a reading function is given besides the members to fill. Of the scene everything before its object has been read.
struct Reading {
    const CheckContext& context;
    const Values& values;
    const Scene& scene;
};

/// The file of a key that passed the check.
[[nodiscard]] std::filesystem::path checked_file(const CheckContext& context, const std::string& name);

/// An error about the value of a key that is there; about the object's place where it is absent.
[[nodiscard]] Error fail_at(const CheckContext& context, const Values& values, std::string_view key, std::string message,
                            ErrorCode code = ErrorCode::BadValue);

/// A direction of any length but zero, made a unit vector.
[[nodiscard]] std::optional<Error> read_direction(const CheckContext& context, const Values& values, std::string_view key, Vec3& direction);

/// References to other bodies are left open: see resolve_host_body.
[[nodiscard]] std::optional<Error> read_body(const CheckContext& context, const Values& values, SceneBody& body);

/// embedded_in, once all bodies are known.
[[nodiscard]] std::optional<Error> resolve_host_body(const CheckContext& context, const Values& values, const Scene& scene, SceneBody& body);

/// Bodies have been read.
[[nodiscard]] std::optional<Error> read_target(const CheckContext& context, const Values& values, const Scene& scene, SceneTarget& target);

/// Bodies and targets have been read.
[[nodiscard]] std::optional<Error> read_instrument(const CheckContext& context, const Values& values, const Scene& scene,
                                                   SceneInstrument& instrument);

/// The instrument's key path; its name, length and limits are known.
[[nodiscard]] std::optional<Error> read_path(const CheckContext& context, const Values& values, SceneInstrument& instrument);

/// Instruments have been read, with the files that move them.
[[nodiscard]] std::optional<Error> check_path_files(const Scene& scene);

} // namespace trocar::engine
