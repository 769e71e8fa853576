#include "engine/render/gl_objects.hpp"

namespace trocar::engine {

GlTexture make_texture(const GlApi& gl, GLenum format, int width, int height) {
    GlTexture texture(gl);
    gl.TextureStorage2D(texture.name(), 1, format, width, height);
    gl.TextureParameteri(texture.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.TextureParameteri(texture.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

GlTarget make_target(const GlApi& gl, GLenum colour_format, GLenum depth_format, int width, int height) {
    GlTarget target;
    target.colour = make_texture(gl, colour_format, width, height);
    target.framebuffer = GlFramebuffer(gl);
    gl.NamedFramebufferTexture(target.framebuffer.name(), GL_COLOR_ATTACHMENT0, target.colour.name(), 0);
    if (depth_format != 0) {
        target.depth = make_texture(gl, depth_format, width, height);
        gl.NamedFramebufferTexture(target.framebuffer.name(), GL_DEPTH_ATTACHMENT, target.depth.name(), 0);
    }
    return target;
}

} // namespace trocar::engine
