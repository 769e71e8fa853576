#include "engine/render/context.hpp"

#include "engine/render/context_parts.hpp"

#include <fmt/format.h>

#include <dlfcn.h>

namespace trocar::engine {

const char* name_of(ContextKind kind) noexcept {
    switch (kind) {
    case ContextKind::EglDevice:
        return "EGL device";
    case ContextKind::EglSurfaceless:
        return "EGL surfaceless";
    case ContextKind::OsMesa:
        return "OSMesa";
    }
    return "unknown";
}

GlContext::GlContext(ContextKind kind) : kind_(kind), api_(new GlApi, [](GlApi* api) { delete api; }) {}

bool GlContext::is_software() const noexcept {
    for (const char* name : {"llvmpipe", "softpipe", "swrast"})
        if (renderer_name_.find(name) != std::string::npos) return true;
    return false;
}

void* open_library(const std::string& name, std::string& reason) {
    void* library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (library == nullptr) {
        const char* words = dlerror();
        reason = words != nullptr ? words : name + " cannot be opened";
    }
    return library;
}

void* find_symbol(void* library, const char* name) noexcept { return dlsym(library, name); }

std::string ContextBuilder::complete(GlContext& context, const std::function<void*(const char*)>& find) {
    const CurrentContext current(context);
    if (!current.ok()) return "the context cannot be made current";
    GlApi& api = *context.api_;
    if (const char* missing = load_gl_api(api, find)) return fmt::format("the driver has no {}", missing);
    GLint major = 0;
    GLint minor = 0;
    api.GetIntegerv(GL_MAJOR_VERSION, &major);
    api.GetIntegerv(GL_MINOR_VERSION, &minor);
    if (major * 10 + minor < kGlMajor * 10 + kGlMinor)
        return fmt::format("OpenGL {}.{} where {}.{} is needed", major, minor, kGlMajor, kGlMinor);
    const auto text = [&](GLenum what) {
        const GLubyte* words = api.GetString(what);
        return std::string(words != nullptr ? reinterpret_cast<const char*>(words) : "unknown");
    };
    context.renderer_name_ = text(GL_RENDERER);
    context.version_ = text(GL_VERSION);
    return {};
}

Result<std::unique_ptr<GlContext>> make_context(const ContextOptions& options) {
    std::vector<ContextAttempt> attempts;
    for (const ContextKind kind : options.order) {
        ContextOutcome outcome =
            kind == ContextKind::OsMesa ? make_osmesa_context(options.osmesa_library) : make_egl_context(kind, options.egl_library);
        attempts.push_back({kind, outcome.reason});
        if (!outcome.context) continue;
        ContextBuilder::set_attempts(*outcome.context, std::move(attempts));
        if (options.adjust) options.adjust(ContextBuilder::api(*outcome.context));
        return std::move(outcome.context);
    }
    std::string tried;
    for (const ContextAttempt& attempt : attempts)
        tried += fmt::format("{}{}: {}", tried.empty() ? "" : "; ", name_of(attempt.kind), attempt.reason);
    return Error{ErrorCode::MissingTool,
                 fmt::format("no OpenGL {}.{} for pictures ({}); on Debian: apt install libegl1 libgl1-mesa-dri libosmesa6", kGlMajor,
                             kGlMinor, tried.empty() ? "nothing was tried" : tried)};
}

} // namespace trocar::engine
