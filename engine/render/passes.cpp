// Both pictures are drawn with four samples to a pixel and a border of one sample around each tile, which the tent
// filter of the last pass reaches into.
#include "engine/render/passes.hpp"

#include "engine/render/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <vector>

namespace trocar::engine {
namespace {

constexpr int kSamplesPerSide = 2;
constexpr int kBorder = 1; // samples around a tile
constexpr std::size_t kNodeBytes = 16;
constexpr std::size_t kMaxNodeBytes = std::size_t{128} << 20; // the least that llvmpipe allows one buffer to be
constexpr int kSmallestTile = 16;                             // pixels a side; below this a list that does not fit is given up
constexpr std::uint32_t kListEnd = 0xffffffffU;

// The uniforms of one program by name; unknown names are ignored, as GL does.
class Uniforms {
public:
    Uniforms(const GlApi& gl, GLuint program) : gl_(gl), program_(program) { gl.UseProgram(program); }
    void set(const char* name, float a) const { gl_.Uniform1f(at(name), a); }
    void set(const char* name, std::uint32_t a) const { gl_.Uniform1ui(at(name), a); }
    void set(const char* name, float a, float b) const { gl_.Uniform2f(at(name), a, b); }
    void set(const char* name, float a, float b, float c) const { gl_.Uniform3f(at(name), a, b, c); }
    void set(const char* name, const std::array<float, 3>& rgb, float alpha) const {
        gl_.Uniform4f(at(name), rgb[0], rgb[1], rgb[2], alpha);
    }
    void set(const char* name, const Mat4f& matrix) const { gl_.UniformMatrix4fv(at(name), 1, GL_FALSE, matrix.data()); }

private:
    [[nodiscard]] GLint at(const char* name) const { return gl_.GetUniformLocation(program_, name); }
    const GlApi& gl_;
    GLuint program_;
};

[[nodiscard]] constexpr int sample_count(int pixels) noexcept { return kSamplesPerSide * pixels + 2 * kBorder; }
[[nodiscard]] constexpr float first_sample(int pixel) noexcept { return static_cast<float>(kSamplesPerSide * pixel - kBorder); }

// The projection extended by the border around the whole picture.
[[nodiscard]] Mat4f widened_clip(const Projection& view) noexcept {
    Mat4f clip = view.clip_from_view;
    clip.row(0) *= static_cast<float>(kSamplesPerSide * view.width) / static_cast<float>(sample_count(view.width));
    clip.row(1) *= static_cast<float>(kSamplesPerSide * view.height) / static_cast<float>(sample_count(view.height));
    return clip;
}

void set_sample_viewport(const PassContext& pass, const Tile& tile) {
    pass.gl.Viewport(-kSamplesPerSide * tile.x, -kSamplesPerSide * tile.y, sample_count(pass.view.width), sample_count(pass.view.height));
}

[[nodiscard]] Uniforms use_surface_program(const PassContext& pass, GLuint program) {
    Uniforms uniforms(pass.gl, program);
    uniforms.set("view_from_origin", pass.view.view_from_origin);
    uniforms.set("clip_from_view", widened_clip(pass.view));
    uniforms.set("to_eye_orthographic", 0.0F, 0.0F, pass.view.orthographic ? 1.0F : 0.0F);
    uniforms.set("gloss", 1.0F);
    return uniforms;
}

void draw_full_screen(const PassContext& pass) {
    pass.gl.Disable(GL_DEPTH_TEST);
    pass.gl.BindVertexArray(pass.empty_layout);
    pass.gl.DrawArrays(GL_TRIANGLES, 0, 3);
}

// The last pass of both pictures, and the way back.
void finish_tile(const PassContext& pass, const Tile& tile, GLuint samples, GLuint program, Picture& picture) {
    const GlApi& gl = pass.gl;
    const GlTarget target = make_target(gl, GL_RGBA8, 0, tile.width, tile.height);
    gl.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer.name());
    gl.Viewport(0, 0, tile.width, tile.height);
    const Uniforms uniforms(gl, program);
    uniforms.set("tile_offset", static_cast<float>(tile.x), static_cast<float>(tile.y));
    uniforms.set("picture_size", static_cast<float>(pass.view.width), static_cast<float>(pass.view.height));
    gl.BindTextureUnit(0, samples);
    draw_full_screen(pass);

    std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.height));
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.ReadPixels(0, 0, tile.width, tile.height, GL_RGB, GL_UNSIGNED_BYTE, rgb.data());
    const std::size_t row_bytes = 3 * static_cast<std::size_t>(tile.width);
    for (int row = 0; row < tile.height; ++row) {
        const std::uint8_t* from = rgb.data() + static_cast<std::size_t>(row) * row_bytes;
        std::copy(from, from + row_bytes, picture.pixel(tile.x, picture.height - 1 - tile.y - row));
    }
}

[[nodiscard]] Result<void> check_driver(const PassContext& pass) {
    const GLenum error = pass.gl.GetError();
    if (error == GL_NO_ERROR) return {};
    return Error{ErrorCode::ToolFailed, error == GL_OUT_OF_MEMORY ? "the graphics driver is out of memory; ask for a smaller picture"
                                                                  : fmt::format("the graphics driver reports error {:#x}", error)};
}

enum class TileOutcome { Done, TooManyLayers };
using TilePass = std::function<TileOutcome(const Tile&)>;

// Draws the picture in tiles, halving those that are too large or whose lists do not fit.
[[nodiscard]] Result<void> draw_tiles(const PassContext& pass, const TilePass& draw_tile) {
    std::vector<Tile> todo = {{0, 0, pass.view.width, pass.view.height}};
    while (!todo.empty()) {
        const Tile tile = todo.back();
        todo.pop_back();
        const bool too_large = tile.width * tile.height > kMaxTilePixels || std::max(tile.width, tile.height) > kMaxTileSide;
        if (!too_large && draw_tile(tile) == TileOutcome::Done) {
            if (Result<void> fine = check_driver(pass); !fine) return fine;
            continue;
        }
        if (std::max(tile.width, tile.height) <= kSmallestTile)
            return Error{ErrorCode::ToolFailed, "more transparent layers in one place than the picture's lists can hold"};
        Tile first = tile;
        Tile second = tile;
        if (tile.width >= tile.height) {
            first.width = tile.width / 2;
            second.x += first.width;
            second.width -= first.width;
        } else {
            first.height = tile.height / 2;
            second.y += first.height;
            second.height -= first.height;
        }
        todo.push_back(second);
        todo.push_back(first);
    }
    return {};
}

// The lists of transparent fragments; one buffer for all tiles.
struct LayerLists {
    GlBuffer counter;
    GlBuffer nodes;
    std::uint32_t capacity = 0;
    bool wanted = false; // the scene has transparent bodies
};

[[nodiscard]] LayerLists make_lists(const PassContext& pass) {
    LayerLists lists;
    lists.wanted = std::any_of(pass.items.begin(), pass.items.end(), [](const DrawItem& item) { return item.transparent(); });
    GLint largest = 0;
    pass.gl.GetIntegerv(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &largest);
    const std::size_t bytes = lists.wanted ? std::min(kMaxNodeBytes, static_cast<std::size_t>(std::max(largest, 1))) : kNodeBytes;
    lists.capacity = static_cast<std::uint32_t>(bytes / kNodeBytes);
    lists.counter = GlBuffer(pass.gl);
    lists.nodes = GlBuffer(pass.gl);
    pass.gl.NamedBufferData(lists.counter.name(), sizeof(std::uint32_t), nullptr, GL_DYNAMIC_COPY);
    pass.gl.NamedBufferData(lists.nodes.name(), static_cast<GLsizeiptr>(bytes), nullptr, GL_DYNAMIC_COPY);
    return lists;
}

void draw_opaque_bodies(const PassContext& pass) {
    const GlApi& gl = pass.gl;
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_LESS);
    gl.DepthMask(GL_TRUE);
    const Uniforms uniforms = use_surface_program(pass, pass.programs.opaque);
    for (const DrawItem& item : pass.items) {
        if (item.transparent()) continue;
        uniforms.set("base_colour", item.colour, 1.0F);
        uniforms.set("emphasis", item.emphasis);
        draw(gl, item);
    }
}

// returns  how many fragments the lists were given, whether they fitted or not
[[nodiscard]] std::uint32_t draw_layers(const PassContext& pass, const LayerLists& lists) {
    const GlApi& gl = pass.gl;
    const std::uint32_t zero = 0;
    gl.NamedBufferSubData(lists.counter.name(), 0, sizeof zero, &zero);
    gl.DepthMask(GL_FALSE);
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    const Uniforms uniforms = use_surface_program(pass, pass.programs.layer);
    uniforms.set("capacity", lists.capacity);
    for (const DrawItem& item : pass.items) {
        if (!item.transparent() || item.opacity <= 0.0F) continue;
        uniforms.set("base_colour", item.colour, item.opacity);
        draw(gl, item);
    }
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.DepthMask(GL_TRUE);
    gl.MemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    std::uint32_t count = 0;
    gl.GetNamedBufferSubData(lists.counter.name(), 0, sizeof count, &count);
    return count;
}

[[nodiscard]] TileOutcome draw_shaded_tile(const PassContext& pass, const LayerLists& lists, const Tile& tile, Picture& picture) {
    const GlApi& gl = pass.gl;
    const int width = sample_count(tile.width);
    const int height = sample_count(tile.height);
    const GlTarget bodies = make_target(gl, GL_RGBA16F, GL_DEPTH_COMPONENT32F, width, height);
    const GlTexture heads = make_texture(gl, GL_R32UI, width, height);
    gl.ClearTexImage(heads.name(), 0, GL_RED_INTEGER, GL_UNSIGNED_INT, &kListEnd);
    const std::array<float, 4> nothing = {};
    const float farthest = 1.0F;
    gl.ClearNamedFramebufferfv(bodies.framebuffer.name(), GL_COLOR, 0, nothing.data());
    gl.ClearNamedFramebufferfv(bodies.framebuffer.name(), GL_DEPTH, 0, &farthest);
    gl.BindFramebuffer(GL_FRAMEBUFFER, bodies.framebuffer.name());
    gl.BindImageTexture(0, heads.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_R32UI);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, lists.counter.name());
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, lists.nodes.name());
    set_sample_viewport(pass, tile);
    draw_opaque_bodies(pass);
    if (lists.wanted && draw_layers(pass, lists) > lists.capacity) return TileOutcome::TooManyLayers;

    const GlTarget resolved = make_target(gl, GL_RGBA16F, 0, width, height);
    gl.BindFramebuffer(GL_FRAMEBUFFER, resolved.framebuffer.name());
    gl.Viewport(0, 0, width, height);
    const Uniforms uniforms(gl, pass.programs.resolve);
    uniforms.set("tile_offset", first_sample(tile.x), first_sample(tile.y));
    uniforms.set("picture_size", static_cast<float>(kSamplesPerSide * pass.view.width),
                 static_cast<float>(kSamplesPerSide * pass.view.height));
    uniforms.set("has_layers", lists.wanted ? 1U : 0U);
    gl.BindTextureUnit(0, bodies.colour.name());
    gl.BindTextureUnit(1, bodies.depth.name());
    draw_full_screen(pass);
    finish_tile(pass, tile, resolved.colour.name(), pass.programs.shaded, picture);
    return TileOutcome::Done;
}

void draw_thickness(const PassContext& pass) {
    const GlApi& gl = pass.gl;
    gl.Disable(GL_DEPTH_TEST);
    gl.Enable(GL_DEPTH_CLAMP); // a wall cut off by the near plane would leave its body open
    gl.Enable(GL_BLEND);
    gl.BlendEquation(GL_FUNC_ADD);
    gl.BlendFunc(GL_ONE, GL_ONE);
    const Uniforms uniforms = use_surface_program(pass, pass.programs.thickness);
    uniforms.set("reference", static_cast<float>((pass.view.origin - pass.view.eye).dot(pass.view.forward)));
    uniforms.set("orthographic", pass.view.orthographic ? 1.0F : 0.0F);
    for (const DrawItem& item : pass.items) {
        if (!item.fluoro_thickness) continue;
        uniforms.set("attenuation", item.attenuation);
        draw(gl, item);
    }
    gl.Disable(GL_BLEND);
    gl.Disable(GL_DEPTH_CLAMP);
}

[[nodiscard]] TileOutcome draw_fluoroscopy_tile(const PassContext& pass, const Tile& tile, Picture& picture) {
    const GlApi& gl = pass.gl;
    const int width = sample_count(tile.width);
    const int height = sample_count(tile.height);
    const GlTarget absorbance = make_target(gl, GL_R32F, 0, width, height);
    const std::array<float, 4> nothing = {};
    gl.ClearNamedFramebufferfv(absorbance.framebuffer.name(), GL_COLOR, 0, nothing.data());
    gl.BindFramebuffer(GL_FRAMEBUFFER, absorbance.framebuffer.name());
    set_sample_viewport(pass, tile);
    draw_thickness(pass);

    const GlTarget intensity = make_target(gl, GL_R32F, 0, width, height);
    gl.BindFramebuffer(GL_FRAMEBUFFER, intensity.framebuffer.name());
    gl.Viewport(0, 0, width, height);
    gl.UseProgram(pass.programs.transmit);
    gl.BindTextureUnit(0, absorbance.colour.name());
    draw_full_screen(pass);
    finish_tile(pass, tile, intensity.colour.name(), pass.programs.fluoroscopy, picture);
    return TileOutcome::Done;
}

} // namespace

Result<Programs> make_programs(const GlApi& gl) {
    struct Source {
        GLuint Programs::*program;
        std::string_view vertex, fragment;
    };
    constexpr Source kSources[] = {
        {&Programs::opaque, "surface.vert.glsl", "opaque.frag.glsl"},
        {&Programs::layer, "surface.vert.glsl", "layer.frag.glsl"},
        {&Programs::resolve, "screen.vert.glsl", "resolve.frag.glsl"},
        {&Programs::shaded, "screen.vert.glsl", "shaded.frag.glsl"},
        {&Programs::thickness, "surface.vert.glsl", "thickness.frag.glsl"},
        {&Programs::transmit, "screen.vert.glsl", "transmit.frag.glsl"},
        {&Programs::fluoroscopy, "screen.vert.glsl", "fluoroscopy.frag.glsl"},
    };
    Programs programs;
    for (const Source& source : kSources) {
        const Result<GLuint> program = make_program(gl, source.vertex, source.fragment);
        if (!program) return program.error();
        programs.*source.program = *program;
    }
    return programs;
}

Result<void> draw_shaded(const PassContext& pass, Picture& picture) {
    const LayerLists lists = make_lists(pass);
    return draw_tiles(pass, [&](const Tile& tile) { return draw_shaded_tile(pass, lists, tile, picture); });
}

Result<void> draw_fluoroscopy(const PassContext& pass, Picture& picture) {
    return draw_tiles(pass, [&](const Tile& tile) { return draw_fluoroscopy_tile(pass, tile, picture); });
}

} // namespace trocar::engine
