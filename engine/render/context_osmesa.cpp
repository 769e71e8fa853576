// OSMesa: Mesa's software renderer as a plain library, without EGL. Needs a buffer to be made current; pictures go to
// framebuffer objects, so one dummy pixel row is enough.
#include "engine/render/context_parts.hpp"

#include <array>

namespace trocar::engine {
namespace {

// From GL/osmesa.h, whose package is not worth a build dependency for nine constants and four functions.
struct OsMesaOpaque;
using OsMesaHandle = OsMesaOpaque*;
using OsMesaCreate = OsMesaHandle (*)(const int* attributes, OsMesaHandle share);
using OsMesaDestroy = void (*)(OsMesaHandle context);
using OsMesaMakeCurrent = GLboolean (*)(OsMesaHandle context, void* buffer, GLenum type, GLsizei width, GLsizei height);
using OsMesaGetProc = void (*(*)(const char* name))();

constexpr int kOsMesaFormat = 0x22;
constexpr int kOsMesaRgba = GL_RGBA;
constexpr int kOsMesaProfile = 0x33;
constexpr int kOsMesaCoreProfile = 0x34;
constexpr int kOsMesaMajor = 0x36;
constexpr int kOsMesaMinor = 0x37;
constexpr int kDummySide = 4; // pixels

class OsMesaContext final : public GlContext {
public:
    OsMesaContext(OsMesaHandle context, OsMesaMakeCurrent make_it_current, OsMesaDestroy destroy)
        : GlContext(ContextKind::OsMesa), context_(context), make_current_(make_it_current), destroy_(destroy) {}
    ~OsMesaContext() override { destroy_(context_); }
    bool make_current() noexcept override {
        return make_current_(context_, dummy_.data(), GL_UNSIGNED_BYTE, kDummySide, kDummySide) == GL_TRUE;
    }
    void release() noexcept override { make_current_(nullptr, nullptr, 0, 0, 0); }

private:
    OsMesaHandle context_;
    OsMesaMakeCurrent make_current_;
    OsMesaDestroy destroy_;
    std::array<unsigned char, 4 * kDummySide* kDummySide> dummy_ = {};
};

} // namespace

ContextOutcome make_osmesa_context(const std::string& library_name) {
    std::string reason;
    void* library = open_library(library_name, reason);
    if (library == nullptr) return {nullptr, reason};
    const auto create = reinterpret_cast<OsMesaCreate>(find_symbol(library, "OSMesaCreateContextAttribs"));
    const auto destroy = reinterpret_cast<OsMesaDestroy>(find_symbol(library, "OSMesaDestroyContext"));
    const auto make_current = reinterpret_cast<OsMesaMakeCurrent>(find_symbol(library, "OSMesaMakeCurrent"));
    const auto get_proc = reinterpret_cast<OsMesaGetProc>(find_symbol(library, "OSMesaGetProcAddress"));
    if (create == nullptr || destroy == nullptr || make_current == nullptr || get_proc == nullptr)
        return {nullptr, "the library is not OSMesa 11.2 or later"};

    const std::array<int, 9> attributes = {
        kOsMesaFormat, kOsMesaRgba, kOsMesaProfile, kOsMesaCoreProfile, kOsMesaMajor, kGlMajor, kOsMesaMinor, kGlMinor, 0};
    const OsMesaHandle raw = create(attributes.data(), nullptr);
    if (raw == nullptr) return {nullptr, "no OpenGL 4.5 core"};
    auto context = std::make_unique<OsMesaContext>(raw, make_current, destroy);
    reason = ContextBuilder::complete(*context, [&](const char* name) { return reinterpret_cast<void*>(get_proc(name)); });
    if (!reason.empty()) return {nullptr, std::move(reason)};
    return {std::move(context), {}};
}

} // namespace trocar::engine
