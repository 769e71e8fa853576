// OpenGL 4.5 core without a display. Three ways in, tried in this order: EGL on a device, EGL without a surface, OSMesa.
// Libraries are opened at run time, so a machine without them runs everything but pictures, and says why.
#pragma once

#include "base/result.hpp"
#include "engine/render/gl_context.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trocar::engine {

struct ContextOptions {
    /// What may be tried, in order.
    std::vector<ContextKind> order = {ContextKind::EglDevice, ContextKind::EglSurfaceless, ContextKind::OsMesa};
    std::string egl_library = "libEGL.so.1";
    std::string osmesa_library = "libOSMesa.so.8";
    /// Sees the entry points of the context that was taken before anything is drawn, and may put others in their place: who wants to
    /// count calls, or to see what happens when a driver refuses one.
    std::function<void(GlApi&)> adjust = {};
};

/// The first context of `options.order` that gives OpenGL 4.5 core.
/// failure  MissingTool: every way in, why it failed, and the packages that would help
[[nodiscard]] Result<std::unique_ptr<GlContext>> make_context(const ContextOptions& options = {});

} // namespace trocar::engine
