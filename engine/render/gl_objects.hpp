// Private to engine/render: owners of GL names. All of them must end while their context is current.
#pragma once

#include "engine/render/gl_api.hpp"

#include <utility>

namespace trocar::engine {

enum class GlKind { Buffer, Texture, Framebuffer, VertexArray };

template <GlKind kKind>
class GlObject {
public:
    GlObject() = default;
    explicit GlObject(const GlApi& gl, GLenum target = GL_TEXTURE_2D) : gl_(&gl) {
        if constexpr (kKind == GlKind::Buffer) gl.CreateBuffers(1, &name_);
        if constexpr (kKind == GlKind::Texture) gl.CreateTextures(target, 1, &name_);
        if constexpr (kKind == GlKind::Framebuffer) gl.CreateFramebuffers(1, &name_);
        if constexpr (kKind == GlKind::VertexArray) gl.CreateVertexArrays(1, &name_);
    }
    GlObject(GlObject&& other) noexcept : gl_(std::exchange(other.gl_, nullptr)), name_(std::exchange(other.name_, 0)) {}
    GlObject& operator=(GlObject&& other) noexcept {
        std::swap(gl_, other.gl_);
        std::swap(name_, other.name_);
        return *this;
    }
    ~GlObject() {
        if (gl_ == nullptr) return;
        if constexpr (kKind == GlKind::Buffer) gl_->DeleteBuffers(1, &name_);
        if constexpr (kKind == GlKind::Texture) gl_->DeleteTextures(1, &name_);
        if constexpr (kKind == GlKind::Framebuffer) gl_->DeleteFramebuffers(1, &name_);
        if constexpr (kKind == GlKind::VertexArray) gl_->DeleteVertexArrays(1, &name_);
    }
    [[nodiscard]] GLuint name() const noexcept { return name_; }

private:
    const GlApi* gl_ = nullptr;
    GLuint name_ = 0;
};

using GlBuffer = GlObject<GlKind::Buffer>;
using GlTexture = GlObject<GlKind::Texture>;
using GlFramebuffer = GlObject<GlKind::Framebuffer>;
using GlVertexArray = GlObject<GlKind::VertexArray>;

/// A texture of one level, and a framebuffer that draws into it.
struct GlTarget {
    GlTexture colour;
    GlTexture depth; // without a name where the pass needs none
    GlFramebuffer framebuffer;
};

[[nodiscard]] GlTexture make_texture(const GlApi& gl, GLenum format, int width, int height);
/// depth_format  0: no depth texture
[[nodiscard]] GlTarget make_target(const GlApi& gl, GLenum colour_format, GLenum depth_format, int width, int height);

} // namespace trocar::engine
