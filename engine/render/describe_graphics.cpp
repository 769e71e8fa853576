#include "engine/render/describe_graphics.hpp"

#include "engine/render/gl_cull_backend.hpp"

#include <fmt/format.h>

namespace trocar::engine {

std::vector<GraphicsLine> describe_graphics(const ContextOptions& options) {
    const auto context = make_context(options);
    if (!context.ok()) return {{"none", context.error().message}, {"culling", "by the CPU reference"}};
    std::vector<GraphicsLine> lines;
    for (const ContextAttempt& attempt : (*context)->attempts())
        lines.push_back({name_of(attempt.kind),
                         attempt.reason.empty() ? fmt::format("taken: {}, OpenGL {}", (*context)->renderer_name(), (*context)->version())
                                                : attempt.reason});
    const auto culler = GlCullBackend::make(options);
    if (!culler.ok())
        lines.push_back({"culling", "by the CPU reference: " + culler.error().message});
    else if ((*culler)->is_software())
        lines.push_back({"culling", "possible, but drawn by software: the CPU reference is used unless OpenGL is asked for"});
    else
        lines.push_back({"culling", fmt::format("in layers of {0} x {0} pixels", (*culler)->preferred_resolution())});
    return lines;
}

} // namespace trocar::engine
