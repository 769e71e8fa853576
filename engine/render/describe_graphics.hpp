// Which way to OpenGL this machine takes for pictures and for culling, what was tried before it, and its capabilities.
#pragma once

#include "engine/render/context.hpp"

namespace trocar::engine {

struct GraphicsLine {
    std::string what, how;
};

/// A line for each way in that was tried, and one on culling. Never fails: no OpenGL at all is an answer.
[[nodiscard]] std::vector<GraphicsLine> describe_graphics(const ContextOptions& options = {});

} // namespace trocar::engine
