// Gives a simulator the graphics device that its scene asks for.
#pragma once

#include "engine/render/context.hpp"
#include "engine/step/simulator.hpp"

namespace trocar::engine {

/// With "culling": "auto" hardware alone is taken, with "opengl" a software renderer too.
/// returns   the outcome as a sentence; empty: nothing was requested
std::string attach_culler(Simulator& simulator, const ContextOptions& options = {});

/// That sentence alone.
[[nodiscard]] std::string describe_culler(const SceneModel& model, const ContextOptions& options = {});

} // namespace trocar::engine
