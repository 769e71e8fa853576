// Private to engine/render: what the three ways to a context share.
#pragma once

#include "engine/render/gl_api.hpp"
#include "engine/render/gl_context.hpp"

#include <functional>

namespace trocar::engine {

/// The OpenGL version that every picture needs: the newest that Mesa's software renderers give.
inline constexpr int kGlMajor = 4;
inline constexpr int kGlMinor = 5;

/// A context, or the reason why there is none.
struct ContextOutcome {
    std::unique_ptr<GlContext> context;
    std::string reason;
};

[[nodiscard]] ContextOutcome make_egl_context(ContextKind kind, const std::string& library);
[[nodiscard]] ContextOutcome make_osmesa_context(const std::string& library);

/// Opens a shared library and keeps it for the life of the process: drivers leave threads and thread-local data
/// behind, and unloading them crashes. RTLD_LOCAL, so that the entry points of two libraries never meet.
/// returns  nullptr and the loader's words in `reason` when it cannot be opened
[[nodiscard]] void* open_library(const std::string& name, std::string& reason);

/// A function of an open library, or nullptr.
[[nodiscard]] void* find_symbol(void* library, const char* name) noexcept;

struct ContextBuilder {
    /// Loads the table of a context that can be made current, and reads its names.
    /// returns  the reason why it is unusable, or an empty string
    [[nodiscard]] static std::string complete(GlContext& context, const std::function<void*(const char*)>& find);
    [[nodiscard]] static GlApi& api(GlContext& context) noexcept { return *context.api_; }
    static void set_attempts(GlContext& context, std::vector<ContextAttempt> attempts) { context.attempts_ = std::move(attempts); }
};

} // namespace trocar::engine
