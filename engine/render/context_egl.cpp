// EGL without a display: on a device of the device list (a GPU's driver or Mesa's software renderer), or on Mesa's
// surfaceless platform. Extensions: EGL_EXT_platform_device, EGL_MESA_platform_surfaceless, EGL_KHR_surfaceless_context.
#include "engine/render/context_parts.hpp"

#define EGL_EGLEXT_PROTOTYPES 0
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace trocar::engine {
namespace {

struct EglApi {
    PFNEGLGETPROCADDRESSPROC GetProcAddress = nullptr;
    PFNEGLQUERYSTRINGPROC QueryString = nullptr;
    PFNEGLINITIALIZEPROC Initialize = nullptr;
    PFNEGLBINDAPIPROC BindAPI = nullptr;
    PFNEGLCHOOSECONFIGPROC ChooseConfig = nullptr;
    PFNEGLCREATECONTEXTPROC CreateContext = nullptr;
    PFNEGLDESTROYCONTEXTPROC DestroyContext = nullptr;
    PFNEGLMAKECURRENTPROC MakeCurrent = nullptr;
    PFNEGLRELEASETHREADPROC ReleaseThread = nullptr;
    PFNEGLGETERRORPROC GetError = nullptr;
    PFNEGLGETPLATFORMDISPLAYEXTPROC GetPlatformDisplayEXT = nullptr;
    PFNEGLQUERYDEVICESEXTPROC QueryDevicesEXT = nullptr;           // absent without EGL_EXT_device_enumeration
    PFNEGLQUERYDEVICESTRINGEXTPROC QueryDeviceStringEXT = nullptr; // absent without EGL_EXT_device_query
};

[[nodiscard]] std::string load(EglApi& egl, void* library) {
    const auto get = [&](auto& function, const char* name) {
        function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(find_symbol(library, name));
        return function != nullptr;
    };
    const bool complete = get(egl.GetProcAddress, "eglGetProcAddress") && get(egl.QueryString, "eglQueryString") &&
                          get(egl.Initialize, "eglInitialize") && get(egl.BindAPI, "eglBindAPI") &&
                          get(egl.ChooseConfig, "eglChooseConfig") && get(egl.CreateContext, "eglCreateContext") &&
                          get(egl.DestroyContext, "eglDestroyContext") && get(egl.MakeCurrent, "eglMakeCurrent") &&
                          get(egl.ReleaseThread, "eglReleaseThread") && get(egl.GetError, "eglGetError");
    if (!complete) return "the library is not EGL 1.4";
    egl.GetPlatformDisplayEXT = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(egl.GetProcAddress("eglGetPlatformDisplayEXT"));
    egl.QueryDevicesEXT = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(egl.GetProcAddress("eglQueryDevicesEXT"));
    egl.QueryDeviceStringEXT = reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(egl.GetProcAddress("eglQueryDeviceStringEXT"));
    return egl.GetPlatformDisplayEXT != nullptr ? "" : "no EGL_EXT_platform_base";
}

// Displays are never terminated: EGL hands the same one to every caller of the process, and the first to terminate
// it would take it away from the others.
class EglContext final : public GlContext {
public:
    EglContext(ContextKind kind, const EglApi& egl, EGLDisplay display, EGLContext context)
        : GlContext(kind), egl_(egl), display_(display), context_(context) {}
    ~EglContext() override { egl_.DestroyContext(display_, context_); }
    bool make_current() noexcept override { return egl_.MakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE; }
    void release() noexcept override {
        egl_.MakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        egl_.ReleaseThread();
    }

private:
    EglApi egl_;
    EGLDisplay display_;
    EGLContext context_;
};

[[nodiscard]] bool has_extension(const char* list, std::string_view name) {
    if (list == nullptr) return false;
    const std::string_view all(list);
    for (std::size_t at = all.find(name); at != std::string_view::npos; at = all.find(name, at + 1)) {
        const std::size_t end = at + name.size();
        if ((at == 0 || all[at - 1] == ' ') && (end == all.size() || all[end] == ' ')) return true;
    }
    return false;
}

[[nodiscard]] ContextOutcome make_on_display(ContextKind kind, const EglApi& egl, EGLDisplay display) {
    EGLint major = 0;
    EGLint minor = 0;
    if (display == EGL_NO_DISPLAY || egl.Initialize(display, &major, &minor) != EGL_TRUE)
        return {nullptr, fmt::format("the display cannot be initialised (EGL error {:#x})", egl.GetError())};
    if (!has_extension(egl.QueryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context"))
        return {nullptr, "no EGL_KHR_surfaceless_context"};
    if (egl.BindAPI(EGL_OPENGL_API) != EGL_TRUE) return {nullptr, "the driver has no desktop OpenGL"};

    const std::array<EGLint, 5> wanted = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (egl.ChooseConfig(display, wanted.data(), &config, 1, &count) != EGL_TRUE || count < 1) {
        if (!has_extension(egl.QueryString(display, EGL_EXTENSIONS), "EGL_KHR_no_config_context"))
            return {nullptr, "no configuration for OpenGL"};
        config = EGL_NO_CONFIG_KHR;
    }
    // With notification of resets, so that a lost context is an error and not a wrong answer; without where the driver has none.
    const std::array<EGLint, 9> version = {EGL_CONTEXT_MAJOR_VERSION_KHR,
                                           kGlMajor,
                                           EGL_CONTEXT_MINOR_VERSION_KHR,
                                           kGlMinor,
                                           EGL_CONTEXT_OPENGL_PROFILE_MASK_KHR,
                                           EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT_KHR,
                                           EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY_KHR,
                                           EGL_LOSE_CONTEXT_ON_RESET_KHR,
                                           EGL_NONE};
    std::array<EGLint, 9> plain = version;
    plain[6] = EGL_NONE;
    EGLContext raw = egl.CreateContext(display, config, EGL_NO_CONTEXT, version.data());
    if (raw == EGL_NO_CONTEXT) raw = egl.CreateContext(display, config, EGL_NO_CONTEXT, plain.data());
    if (raw == EGL_NO_CONTEXT) return {nullptr, fmt::format("no OpenGL {}.{} core (EGL error {:#x})", kGlMajor, kGlMinor, egl.GetError())};
    auto context = std::make_unique<EglContext>(kind, egl, display, raw);
    std::string reason =
        ContextBuilder::complete(*context, [&](const char* name) { return reinterpret_cast<void*>(egl.GetProcAddress(name)); });
    if (!reason.empty()) return {nullptr, std::move(reason)};
    return {std::move(context), {}};
}

/// Hardware comes first, whatever the list's order: a machine with a card has Mesa's software renderer in the same list. Devices that
/// do not say so of themselves, and turn out to be drawn by the CPU, are taken only where nothing else is.
[[nodiscard]] ContextOutcome make_on_devices(const EglApi& egl) {
    if (egl.QueryDevicesEXT == nullptr) return {nullptr, "no EGL_EXT_device_enumeration"};
    std::array<EGLDeviceEXT, 16> devices = {};
    EGLint count = 0;
    if (egl.QueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) != EGL_TRUE || count < 1)
        return {nullptr, "the device list is empty"};
    const auto is_software = [&](EGLDeviceEXT device) {
        return egl.QueryDeviceStringEXT != nullptr &&
               has_extension(egl.QueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
    };
    std::stable_partition(devices.begin(), devices.begin() + count, [&](EGLDeviceEXT device) { return !is_software(device); });
    ContextOutcome software;
    std::string reasons;
    for (EGLint i = 0; i < count; ++i) {
        const EGLDisplay display = egl.GetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr);
        ContextOutcome outcome = make_on_display(ContextKind::EglDevice, egl, display);
        if (!outcome.context)
            reasons += fmt::format("{}device {}: {}", i > 0 ? ", " : "", i, outcome.reason);
        else if (!outcome.context->is_software())
            return outcome;
        else if (!software.context)
            software = std::move(outcome);
    }
    if (!software.context) software.reason = reasons;
    return software;
}

} // namespace

ContextOutcome make_egl_context(ContextKind kind, const std::string& library_name) {
    std::string reason;
    void* library = open_library(library_name, reason);
    if (library == nullptr) return {nullptr, reason};
    EglApi egl;
    reason = load(egl, library);
    if (!reason.empty()) return {nullptr, reason};

    const char* extensions = egl.QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (kind == ContextKind::EglDevice) {
        if (!has_extension(extensions, "EGL_EXT_platform_device")) return {nullptr, "no EGL_EXT_platform_device"};
        return make_on_devices(egl);
    }
    if (!has_extension(extensions, "EGL_MESA_platform_surfaceless")) return {nullptr, "no EGL_MESA_platform_surfaceless"};
    return make_on_display(kind, egl, egl.GetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
}

} // namespace trocar::engine
