// Private to engine/render: the table of OpenGL entry points, one per context. Entry points of two libraries must never
// be mixed, so nothing here is linked against libGL; every function comes from the library that made the context.
#pragma once

#include <GL/glcorearb.h>

namespace trocar::engine {

// X(type without PFNGL and PROC, name without gl)
#define TROCAR_GL_FUNCTIONS(X)                                                                                                             \
    X(ATTACHSHADER, AttachShader)                                                                                                          \
    X(BEGINQUERY, BeginQuery)                                                                                                              \
    X(BINDBUFFERBASE, BindBufferBase)                                                                                                      \
    X(BINDFRAMEBUFFER, BindFramebuffer)                                                                                                    \
    X(BINDIMAGETEXTURE, BindImageTexture)                                                                                                  \
    X(BINDTEXTUREUNIT, BindTextureUnit)                                                                                                    \
    X(BINDVERTEXARRAY, BindVertexArray)                                                                                                    \
    X(BLENDEQUATION, BlendEquation)                                                                                                        \
    X(BLENDFUNC, BlendFunc)                                                                                                                \
    X(CHECKNAMEDFRAMEBUFFERSTATUS, CheckNamedFramebufferStatus)                                                                            \
    X(CLEARNAMEDFRAMEBUFFERFV, ClearNamedFramebufferfv)                                                                                    \
    X(CLEARNAMEDFRAMEBUFFERUIV, ClearNamedFramebufferuiv)                                                                                  \
    X(CLEARTEXIMAGE, ClearTexImage)                                                                                                        \
    X(CLIPCONTROL, ClipControl)                                                                                                            \
    X(COLORMASK, ColorMask)                                                                                                                \
    X(COMPILESHADER, CompileShader)                                                                                                        \
    X(CREATEBUFFERS, CreateBuffers)                                                                                                        \
    X(CREATEFRAMEBUFFERS, CreateFramebuffers)                                                                                              \
    X(CREATEPROGRAM, CreateProgram)                                                                                                        \
    X(CREATEQUERIES, CreateQueries)                                                                                                        \
    X(CREATESHADER, CreateShader)                                                                                                          \
    X(CREATETEXTURES, CreateTextures)                                                                                                      \
    X(CREATEVERTEXARRAYS, CreateVertexArrays)                                                                                              \
    X(DELETEBUFFERS, DeleteBuffers)                                                                                                        \
    X(DELETEFRAMEBUFFERS, DeleteFramebuffers)                                                                                              \
    X(DELETEPROGRAM, DeleteProgram)                                                                                                        \
    X(DELETEQUERIES, DeleteQueries)                                                                                                        \
    X(DELETESHADER, DeleteShader)                                                                                                          \
    X(DELETETEXTURES, DeleteTextures)                                                                                                      \
    X(DELETEVERTEXARRAYS, DeleteVertexArrays)                                                                                              \
    X(DEPTHFUNC, DepthFunc)                                                                                                                \
    X(DEPTHMASK, DepthMask)                                                                                                                \
    X(DISABLE, Disable)                                                                                                                    \
    X(DRAWARRAYS, DrawArrays)                                                                                                              \
    X(DRAWELEMENTS, DrawElements)                                                                                                          \
    X(ENABLE, Enable)                                                                                                                      \
    X(ENABLEVERTEXARRAYATTRIB, EnableVertexArrayAttrib)                                                                                    \
    X(ENDQUERY, EndQuery)                                                                                                                  \
    X(GETERROR, GetError)                                                                                                                  \
    X(GETGRAPHICSRESETSTATUS, GetGraphicsResetStatus)                                                                                      \
    X(GETINTEGERV, GetIntegerv)                                                                                                            \
    X(GETNAMEDBUFFERSUBDATA, GetNamedBufferSubData)                                                                                        \
    X(GETPROGRAMINFOLOG, GetProgramInfoLog)                                                                                                \
    X(GETPROGRAMIV, GetProgramiv)                                                                                                          \
    X(GETQUERYOBJECTUIV, GetQueryObjectuiv)                                                                                                \
    X(GETSHADERINFOLOG, GetShaderInfoLog)                                                                                                  \
    X(GETSHADERIV, GetShaderiv)                                                                                                            \
    X(GETSTRING, GetString)                                                                                                                \
    X(GETSTRINGI, GetStringi)                                                                                                              \
    X(GETUNIFORMLOCATION, GetUniformLocation)                                                                                              \
    X(LINKPROGRAM, LinkProgram)                                                                                                            \
    X(MEMORYBARRIER, MemoryBarrier)                                                                                                        \
    X(NAMEDBUFFERDATA, NamedBufferData)                                                                                                    \
    X(NAMEDBUFFERSUBDATA, NamedBufferSubData)                                                                                              \
    X(NAMEDFRAMEBUFFERDRAWBUFFER, NamedFramebufferDrawBuffer)                                                                              \
    X(NAMEDFRAMEBUFFERPARAMETERI, NamedFramebufferParameteri)                                                                              \
    X(NAMEDFRAMEBUFFERREADBUFFER, NamedFramebufferReadBuffer)                                                                              \
    X(NAMEDFRAMEBUFFERTEXTURE, NamedFramebufferTexture)                                                                                    \
    X(PIXELSTOREI, PixelStorei)                                                                                                            \
    X(READPIXELS, ReadPixels)                                                                                                              \
    X(SHADERSOURCE, ShaderSource)                                                                                                          \
    X(TEXTUREPARAMETERI, TextureParameteri)                                                                                                \
    X(TEXTURESTORAGE2D, TextureStorage2D)                                                                                                  \
    X(TEXTURESTORAGE3D, TextureStorage3D)                                                                                                  \
    X(UNIFORM1F, Uniform1f)                                                                                                                \
    X(UNIFORM1UI, Uniform1ui)                                                                                                              \
    X(UNIFORM2F, Uniform2f)                                                                                                                \
    X(UNIFORM3F, Uniform3f)                                                                                                                \
    X(UNIFORM4F, Uniform4f)                                                                                                                \
    X(UNIFORMMATRIX4FV, UniformMatrix4fv)                                                                                                  \
    X(USEPROGRAM, UseProgram)                                                                                                              \
    X(VERTEXARRAYATTRIBBINDING, VertexArrayAttribBinding)                                                                                  \
    X(VERTEXARRAYATTRIBFORMAT, VertexArrayAttribFormat)                                                                                    \
    X(VERTEXARRAYELEMENTBUFFER, VertexArrayElementBuffer)                                                                                  \
    X(VERTEXARRAYVERTEXBUFFER, VertexArrayVertexBuffer)                                                                                    \
    X(VIEWPORT, Viewport)

struct GlApi {
#define TROCAR_GL_MEMBER(type, name) PFNGL##type##PROC name = nullptr;
    TROCAR_GL_FUNCTIONS(TROCAR_GL_MEMBER)
#undef TROCAR_GL_MEMBER
};

/// Fills the table. `find` is a callable void*(const char*).
/// returns  the first name that is missing, or nullptr
template <class Find>
const char* load_gl_api(GlApi& api, Find&& find) {
#define TROCAR_GL_LOAD(type, name)                                                                                                         \
    api.name = reinterpret_cast<PFNGL##type##PROC>(find("gl" #name));                                                                      \
    if (api.name == nullptr) return "gl" #name;
    TROCAR_GL_FUNCTIONS(TROCAR_GL_LOAD)
#undef TROCAR_GL_LOAD
    return nullptr;
}

} // namespace trocar::engine
