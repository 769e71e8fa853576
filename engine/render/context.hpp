// OpenGL 4.5 core without a display. Three ways in, tried in this order: EGL on a device, EGL without a surface, OSMesa.
// Libraries are opened at run time, so a machine without them runs everything but pictures, and says why.
#pragma once

#include "base/result.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trocar::engine {

struct GlApi; // the table of entry points; only engine/render sees inside

enum class ContextKind : std::uint8_t { EglDevice, EglSurfaceless, OsMesa };

/// "EGL device", "EGL surfaceless", "OSMesa".
[[nodiscard]] const char* name_of(ContextKind kind) noexcept;

struct ContextOptions {
    /// What may be tried, in order.
    std::vector<ContextKind> order = {ContextKind::EglDevice, ContextKind::EglSurfaceless, ContextKind::OsMesa};
    std::string egl_library = "libEGL.so.1";
    std::string osmesa_library = "libOSMesa.so.8";
    /// Called with the entry points of the chosen context before anything is drawn, and may replace them: for tests that
    /// count calls, or simulate a driver that refuses one.
    std::function<void(GlApi&)> adjust = {};
};

/// One way in that was tried: `reason` says why it was not taken; empty: it was.
struct ContextAttempt {
    ContextKind kind;
    std::string reason;
};

/// One OpenGL context with its own table of entry points. Not current until a CurrentContext says so: one library's
/// context must be released before another's is made current, or every call is ignored without an error.
class GlContext {
public:
    virtual ~GlContext() = default;
    GlContext(const GlContext&) = delete;
    GlContext& operator=(const GlContext&) = delete;

    [[nodiscard]] ContextKind kind() const noexcept { return kind_; }
    [[nodiscard]] const std::string& renderer_name() const noexcept { return renderer_name_; } // as the driver calls itself
    [[nodiscard]] const std::string& version() const noexcept { return version_; }
    [[nodiscard]] bool is_software() const noexcept; // drawn by the CPU: llvmpipe, softpipe, swrast
    [[nodiscard]] const std::vector<ContextAttempt>& attempts() const noexcept { return attempts_; }
    [[nodiscard]] const GlApi& api() const noexcept { return *api_; } // valid while the context is current

    [[nodiscard]] virtual bool make_current() noexcept = 0;
    virtual void release() noexcept = 0;

protected:
    explicit GlContext(ContextKind kind);

private:
    friend struct ContextBuilder;
    ContextKind kind_;
    std::string renderer_name_;
    std::string version_;
    std::vector<ContextAttempt> attempts_;
    std::unique_ptr<GlApi, void (*)(GlApi*)> api_;
};

/// Makes a context current for as long as it lives. `ok()` is false when the driver refused.
class CurrentContext {
public:
    explicit CurrentContext(GlContext& context) noexcept : context_(context), ok_(context.make_current()) {}
    ~CurrentContext() { context_.release(); }
    CurrentContext(const CurrentContext&) = delete;
    CurrentContext& operator=(const CurrentContext&) = delete;
    [[nodiscard]] bool ok() const noexcept { return ok_; }

private:
    GlContext& context_;
    bool ok_;
};

/// The first context of `options.order` that gives OpenGL 4.5 core.
/// failure  MissingTool: every way in, why it failed, and the packages that would help
[[nodiscard]] Result<std::unique_ptr<GlContext>> make_context(const ContextOptions& options = {});

} // namespace trocar::engine
