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
    /// Called with the entry points of the chosen context before anything is drawn, and may replace them: for tests that
    /// count calls, or simulate a driver that refuses one.
    std::function<void(GlApi&)> adjust = {};
};

/// The first context of `options.order` that gives OpenGL 4.5 core.
/// failure  MissingTool: every way in, why it failed, and the packages that would help
[[nodiscard]] Result<std::unique_ptr<GlContext>> make_context(const ContextOptions& options = {});

} // namespace trocar::engine
