#include "engine/render/gl_cull_backend.hpp"

#include "engine/render/gl_objects.hpp"
#include "engine/render/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace trocar::engine {

namespace {

using collision::CullJob;
using collision::CullMemory;

/// Of all layers together; more sets than fit are drawn in turns.
constexpr std::size_t kMostBytes = std::size_t{256} << 20;
constexpr std::size_t kBytesPerPixel = 28; // three depths, two names with their backs
constexpr int kMostLayers = 256;           // every driver has as many
constexpr const char* kLayerExtension = "GL_ARB_shader_viewport_layer_array";

bool has_extension(const GlApi& gl, std::string_view name) {
    GLint count = 0;
    gl.GetIntegerv(GL_NUM_EXTENSIONS, &count);
    for (GLint i = 0; i < count; ++i) {
        const auto* text = reinterpret_cast<const char*>(gl.GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i)));
        if (text != nullptr && name == text) return true;
    }
    return false;
}

GlTexture make_layers(const GlApi& gl, GLenum format, int width, int height, int layers) {
    GlTexture texture(gl, GL_TEXTURE_2D_ARRAY);
    gl.TextureStorage3D(texture.name(), 1, format, width, height, layers);
    gl.TextureParameteri(texture.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.TextureParameteri(texture.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

template <class T>
void fill(const GlApi& gl, const GlBuffer& buffer, std::span<const T> items) {
    const std::size_t bytes = std::max<std::size_t>(items.size_bytes(), 16); // an empty buffer cannot be bound
    gl.NamedBufferData(buffer.name(), static_cast<GLsizeiptr>(bytes), items.size_bytes() == bytes ? items.data() : nullptr, GL_STREAM_DRAW);
    if (!items.empty() && items.size_bytes() != bytes)
        gl.NamedBufferSubData(buffer.name(), 0, static_cast<GLsizeiptr>(items.size_bytes()), items.data());
}

} // namespace

struct GlCullBackend::Resources {
    const GlApi& gl;
    GLuint first = 0, second = 0, third = 0, ask = 0; // programs, which the context frees
    GlVertexArray no_attributes;
    GlBuffer footprints, corners, members, questions, hits;
    int width = 0, height = 0, capacity = 0; // of the targets
    bool intervals = false;
    GlTexture who_first, who_second, front_first, front_second, front_third;
    GlFramebuffer draw_first, draw_second, draw_third, draw_nothing;
    std::vector<std::array<std::uint32_t, 4>> corner_words;
    std::vector<std::uint32_t> hit_words;

    explicit Resources(const GlApi& api)
        : gl(api), no_attributes(api), footprints(api), corners(api), members(api), questions(api), hits(api), draw_first(api),
          draw_second(api), draw_third(api), draw_nothing(api) {}

    GlTexture attach(const GlFramebuffer& framebuffer, GLenum where, GLenum format, int layers) const {
        GlTexture texture = make_layers(gl, format, width, height, layers);
        gl.NamedFramebufferTexture(framebuffer.name(), where, texture.name(), 0);
        return texture;
    }
    void make_targets(int layers) {
        front_first = attach(draw_first, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, layers);
        who_first = attach(draw_first, GL_COLOR_ATTACHMENT0, GL_RG32UI, layers);
        front_second = attach(draw_second, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, layers);
        who_second = attach(draw_second, GL_COLOR_ATTACHMENT0, GL_RG32UI, layers);
        front_third = attach(draw_third, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, layers);
        gl.NamedFramebufferDrawBuffer(draw_third.name(), GL_NONE);
        gl.NamedFramebufferReadBuffer(draw_third.name(), GL_NONE);
        gl.NamedFramebufferParameteri(draw_nothing.name(), GL_FRAMEBUFFER_DEFAULT_WIDTH, width);
        gl.NamedFramebufferParameteri(draw_nothing.name(), GL_FRAMEBUFFER_DEFAULT_HEIGHT, height);
        gl.NamedFramebufferDrawBuffer(draw_nothing.name(), GL_NONE);
        gl.NamedFramebufferReadBuffer(draw_nothing.name(), GL_NONE);
    }
    [[nodiscard]] bool targets_are_complete() const {
        return std::ranges::all_of(std::array{&draw_first, &draw_second, &draw_third}, [&](const GlFramebuffer* framebuffer) {
            return gl.CheckNamedFramebufferStatus(framebuffer->name(), GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
        });
    }
    void use(GLuint program, Index first_set) const {
        gl.UseProgram(program);
        gl.Uniform2f(gl.GetUniformLocation(program, "picture"), static_cast<float>(width), static_cast<float>(height));
        gl.Uniform1ui(gl.GetUniformLocation(program, "first_set"), first_set);
    }
    /// Draws these members where the depths and names are cleared first.
    void draw(const GlFramebuffer& framebuffer, GLuint program, Index first_set, std::size_t begin, std::size_t end, bool names) const {
        constexpr float kFar = 1.0f;
        constexpr std::array<GLuint, 4> kNobody = {0xffffffffu, 0, 0, 0};
        gl.ClearNamedFramebufferfv(framebuffer.name(), GL_DEPTH, 0, &kFar);
        if (names) gl.ClearNamedFramebufferuiv(framebuffer.name(), GL_COLOR, 0, kNobody.data());
        gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
        use(program, first_set);
        if (end > begin) gl.DrawArrays(GL_TRIANGLES, static_cast<GLint>(6 * begin), static_cast<GLsizei>(6 * (end - begin)));
    }
};

GlCullBackend::GlCullBackend(std::unique_ptr<GlContext> context) : context_(std::move(context)) {}

GlCullBackend::~GlCullBackend() {
    if (!resources_) return;
    const CurrentContext current(*context_);
    resources_.reset();
}

Result<std::unique_ptr<GlCullBackend>> GlCullBackend::make(const ContextOptions& options) {
    auto context = make_context(options);
    if (!context.ok()) return context.error();
    std::unique_ptr<GlCullBackend> backend(new GlCullBackend(std::move(context).value()));
    const CurrentContext current(*backend->context_);
    if (!current.ok()) return Error{ErrorCode::ToolFailed, "the OpenGL context cannot be made current"};
    const GlApi& gl = backend->context_->api();
    if (!has_extension(gl, kLayerExtension))
        return Error{ErrorCode::MissingTool,
                     fmt::format("{} has no {}, which culling on graphics hardware needs", backend->name(), kLayerExtension)};
    backend->resources_ = std::make_unique<Resources>(gl);
    Resources& r = *backend->resources_;
    struct Wanted {
        GLuint& program;
        const char *vertex, *fragment;
    };
    for (const Wanted& w :
         {Wanted{r.first, "cull_draw.vert.glsl", "cull_first.frag.glsl"}, Wanted{r.second, "cull_draw.vert.glsl", "cull_second.frag.glsl"},
          Wanted{r.third, "cull_draw.vert.glsl", "cull_third.frag.glsl"}, Wanted{r.ask, "cull_ask.vert.glsl", "cull_ask.frag.glsl"}}) {
        const auto program = make_program(gl, w.vertex, w.fragment);
        if (!program.ok()) {
            backend->resources_.reset(); // while the context is current
            return program.error();
        }
        w.program = *program;
    }
    return backend;
}

std::string GlCullBackend::name() const { return fmt::format("{}: {}", name_of(context_->kind()), context_->renderer_name()); }

int GlCullBackend::preferred_resolution() const noexcept { return is_software() ? 256 : 1024; }

void GlCullBackend::reserve(std::size_t prisms, std::size_t questions, int) {
    resources_->corner_words.reserve(prisms);
    resources_->hit_words.reserve(questions);
}

/// As many layers as memory holds; half of them again and again where the driver says it does not.
Result<void> GlCullBackend::prepare_targets(const CullJob& job) {
    Resources& r = *resources_;
    const std::size_t per_layer = kBytesPerPixel * static_cast<std::size_t>(job.width) * static_cast<std::size_t>(job.height);
    const auto fitting = static_cast<int>(std::clamp<std::size_t>(kMostBytes / per_layer, 1, kMostLayers));
    int layers = std::min(fitting, static_cast<int>(job.set_count()));
    if (r.width == job.width && r.height == job.height && r.capacity >= layers) {
        layers_ = std::min(r.capacity, static_cast<int>(job.set_count()));
        return {};
    }
    r.width = job.width;
    r.height = job.height;
    for (;; layers /= 2) {
        r.capacity = 0;
        while (r.gl.GetError() != GL_NO_ERROR) {
        }
        r.make_targets(layers);
        if (r.gl.GetError() == GL_NO_ERROR && r.targets_are_complete()) break;
        if (layers > 1) continue;
        const int side = std::max(job.width, job.height);
        if (side > 1) largest_resolution_ = side / 2;
        return Error{ErrorCode::ToolFailed, fmt::format("{} has no memory for one layer of {} x {} pixels", name(), job.width, job.height)};
    }
    r.capacity = layers_ = layers;
    return {};
}

void GlCullBackend::upload(const CullJob& job) {
    Resources& r = *resources_;
    r.corner_words.resize(job.corners.size());
    for (std::size_t p = 0; p < job.corners.size(); ++p) r.corner_words[p] = {job.corners[p][0], job.corners[p][1], job.corners[p][2], 0};
    for (Index set = 0; set < job.set_count(); ++set)
        for (Index k = job.set_begin[set]; k < job.set_begin[set + 1]; ++k) r.corner_words[job.set_members[k]][3] = set;
    r.hit_words.assign(job.questions.size(), 0);
    fill(r.gl, r.footprints, job.footprints);
    fill(r.gl, r.corners, std::span<const std::array<std::uint32_t, 4>>(r.corner_words));
    fill(r.gl, r.members, job.set_members);
    fill(r.gl, r.questions, job.questions);
    fill(r.gl, r.hits, std::span<const std::uint32_t>(r.hit_words));
    GLuint binding = 0;
    for (const GlBuffer* buffer : {&r.footprints, &r.corners, &r.members, &r.questions, &r.hits})
        r.gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding++, buffer->name());
}

void GlCullBackend::draw_sets(const CullJob& job, Index first, Index last) {
    const Resources& r = *resources_;
    const GlApi& gl = r.gl;
    const std::size_t begin = job.set_begin[first], end = job.set_begin[last];
    const std::size_t asked = job.question_begin[first], asked_end = job.question_begin[last];
    if (asked == asked_end) return;
    const bool intervals = job.memory == CullMemory::Intervals;
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_LESS);
    gl.DepthMask(GL_TRUE);
    gl.BindTextureUnit(0, 0);
    r.draw(r.draw_first, r.first, first, begin, end, true);
    gl.BindTextureUnit(0, r.who_first.name());
    r.draw(r.draw_second, r.second, first, begin, end, true);
    gl.BindTextureUnit(1, r.who_second.name());
    if (intervals) r.draw(r.draw_third, r.third, first, begin, end, false);
    gl.BindTextureUnit(2, r.front_first.name());
    gl.BindTextureUnit(3, r.front_second.name());
    gl.BindTextureUnit(4, r.front_third.name());
    gl.Disable(GL_DEPTH_TEST);
    gl.BindFramebuffer(GL_FRAMEBUFFER, r.draw_nothing.name());
    r.use(r.ask, first);
    gl.Uniform1ui(gl.GetUniformLocation(r.ask, "with_intervals"), intervals ? 1u : 0u);
    gl.DrawArrays(GL_TRIANGLES, static_cast<GLint>(6 * asked), static_cast<GLsizei>(6 * (asked_end - asked)));
    for (GLuint unit = 0; unit < 5; ++unit) gl.BindTextureUnit(unit, 0);
}

/// Fills `hits`; a failed read-back, as from a lost context, is an error and never a missing hit.
Result<void> GlCullBackend::read_hits(std::span<std::uint8_t> hits) {
    Resources& r = *resources_;
    constexpr std::uint32_t kNotRead = 0xdeadbeefu;
    std::fill(r.hit_words.begin(), r.hit_words.end(), kNotRead);
    r.gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    r.gl.GetNamedBufferSubData(r.hits.name(), 0, static_cast<GLsizeiptr>(4 * r.hit_words.size()), r.hit_words.data());
    const GLenum lost = r.gl.GetGraphicsResetStatus(), error = r.gl.GetError();
    const bool unread = std::find(r.hit_words.begin(), r.hit_words.end(), kNotRead) != r.hit_words.end();
    if (lost == GL_NO_ERROR && error == GL_NO_ERROR && !unread) {
        for (std::size_t q = 0; q < hits.size(); ++q) hits[q] = r.hit_words[q] != 0;
        return {};
    }
    r.capacity = 0;
    if (lost != GL_NO_ERROR)
        return Error{ErrorCode::ToolFailed, fmt::format("{}: the context was lost (reset status {:#x})", name(), lost)};
    if (error == GL_NO_ERROR) return Error{ErrorCode::ToolFailed, name() + ": the answers could not be read back"};
    return Error{ErrorCode::ToolFailed, fmt::format("{}: OpenGL error {:#x} while culling", name(), error)};
}

Result<void> GlCullBackend::find_hits(const CullJob& job, std::span<std::uint8_t> hits) {
    if (job.questions.empty()) return {};
    const CurrentContext current(*context_);
    if (!current.ok()) return Error{ErrorCode::ToolFailed, name() + ": the context was lost"};
    Resources& r = *resources_;
    auto ready = prepare_targets(job);
    if (!ready.ok()) return ready;
    upload(job);
    r.gl.BindVertexArray(r.no_attributes.name());
    r.gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    r.gl.Viewport(0, 0, job.width, job.height);
    for (Index first = 0; first < job.set_count(); first += static_cast<Index>(layers_))
        draw_sets(job, first, std::min(job.set_count(), first + static_cast<Index>(layers_)));
    return read_hits(hits);
}

} // namespace trocar::engine
