#include "engine/render/gl_canvas.hpp"

#include "engine/render/gl_objects.hpp"
#include "engine/render/program.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

/// Queries under way at once: enough that the device is not waited for after each.
constexpr std::size_t kQueriesAtOnce = 4096;

} // namespace

struct GlCanvas::Resources {
    const GlApi& gl;
    GLuint program = 0; // the context frees it
    GLint with_back = -1;
    GlVertexArray no_attributes;
    GlBuffer footprints, corners; // the second is declared by the shaders and not read
    GlTexture depth;
    GlFramebuffer framebuffer;
    int width = 0, height = 0;
    std::vector<GLuint> queries;

    explicit Resources(const GlApi& api)
        : gl(api), no_attributes(api), footprints(api), corners(api), framebuffer(api), queries(kQueriesAtOnce) {
        gl.CreateQueries(GL_ANY_SAMPLES_PASSED, static_cast<GLsizei>(queries.size()), queries.data());
    }
    ~Resources() { gl.DeleteQueries(static_cast<GLsizei>(queries.size()), queries.data()); }
};

GlCanvas::GlCanvas(std::unique_ptr<GlContext> context) : context_(std::move(context)) {}

GlCanvas::~GlCanvas() {
    if (!current_) current_ = std::make_unique<CurrentContext>(*context_);
    resources_.reset();
    current_.reset();
}

Result<std::unique_ptr<GlCanvas>> GlCanvas::make(const ContextOptions& options) {
    auto context = make_context(options);
    if (!context.ok()) return context.error();
    std::unique_ptr<GlCanvas> canvas(new GlCanvas(std::move(context).value()));
    const CurrentContext current(*canvas->context_);
    if (!current.ok()) return Error{ErrorCode::ToolFailed, "the OpenGL context cannot be made current"};
    const GlApi& gl = canvas->context_->api();
    canvas->resources_ = std::make_unique<Resources>(gl);
    const auto program = make_program(gl, "cull_query.vert.glsl", "cull_query.frag.glsl");
    if (!program.ok()) {
        canvas->resources_.reset(); // while the context is current
        return program.error();
    }
    canvas->resources_->program = *program;
    canvas->resources_->with_back = gl.GetUniformLocation(*program, "with_back");
    return canvas;
}

std::string GlCanvas::name() const { return fmt::format("queries by {}: {}", name_of(context_->kind()), context_->renderer_name()); }

int GlCanvas::preferred_resolution() const noexcept { return context_->is_software() ? 256 : 1024; }

Result<void> GlCanvas::check(const char* doing) const {
    const GlApi& gl = resources_->gl;
    if (const GLenum lost = gl.GetGraphicsResetStatus(); lost != GL_NO_ERROR)
        return Error{ErrorCode::ToolFailed, fmt::format("{}: the context was lost (reset status {:#x}) while {}", name(), lost, doing)};
    if (const GLenum error = gl.GetError(); error != GL_NO_ERROR)
        return Error{ErrorCode::ToolFailed, fmt::format("{}: OpenGL error {:#x} while {}", name(), error, doing)};
    return {};
}

Result<void> GlCanvas::start(const collision::CullJob& job) {
    current_.reset(); // before another is made: releasing the old one later would make the new one not current
    current_ = std::make_unique<CurrentContext>(*context_);
    if (!current_->ok()) return Error{ErrorCode::ToolFailed, name() + ": the context was lost"};
    Resources& r = *resources_;
    const GlApi& gl = r.gl;
    if (r.width != job.width || r.height != job.height) {
        r.depth = make_texture(gl, GL_DEPTH_COMPONENT32F, job.width, job.height);
        gl.NamedFramebufferTexture(r.framebuffer.name(), GL_DEPTH_ATTACHMENT, r.depth.name(), 0);
        gl.NamedFramebufferDrawBuffer(r.framebuffer.name(), GL_NONE);
        gl.NamedFramebufferReadBuffer(r.framebuffer.name(), GL_NONE);
        if (gl.CheckNamedFramebufferStatus(r.framebuffer.name(), GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            return Error{ErrorCode::ToolFailed, fmt::format("{} has no memory for {} x {} pixels", name(), job.width, job.height)};
        r.width = job.width;
        r.height = job.height;
    }
    constexpr std::array<std::uint32_t, 4> kNothing = {};
    const bool empty = job.footprints.empty();
    gl.NamedBufferData(r.footprints.name(), empty ? sizeof(kNothing) : static_cast<GLsizeiptr>(job.footprints.size_bytes()),
                       empty ? static_cast<const void*>(kNothing.data()) : job.footprints.data(), GL_STREAM_DRAW);
    gl.NamedBufferData(r.corners.name(), sizeof(kNothing), kNothing.data(), GL_STATIC_DRAW);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, r.footprints.name());
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, r.corners.name());
    gl.BindVertexArray(r.no_attributes.name());
    gl.BindFramebuffer(GL_FRAMEBUFFER, r.framebuffer.name());
    gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl.Viewport(0, 0, job.width, job.height);
    gl.Enable(GL_DEPTH_TEST);
    gl.UseProgram(r.program);
    gl.Uniform2f(gl.GetUniformLocation(r.program, "picture"), static_cast<float>(job.width), static_cast<float>(job.height));
    doing_ = Doing::Nothing;
    asked_ = 0;
    behind_.clear();
    return check("starting a view");
}

void GlCanvas::turn_to(Doing what) {
    if (doing_ == what) return;
    const GlApi& gl = resources_->gl;
    doing_ = what;
    gl.DepthFunc(what == Doing::Asking ? GL_GEQUAL : GL_LESS);
    gl.DepthMask(what == Doing::Asking ? GL_FALSE : GL_TRUE);
    gl.Uniform1ui(resources_->with_back, what == Doing::Asking ? 1u : 0u);
}

void GlCanvas::clear() {
    turn_to(Doing::Drawing); // a clear needs the depth mask
    constexpr float kFar = 1.0f;
    resources_->gl.ClearNamedFramebufferfv(resources_->framebuffer.name(), GL_DEPTH, 0, &kFar);
}

void GlCanvas::ask(Index prism) {
    const Resources& r = *resources_;
    if (asked_ == r.queries.size()) collect();
    turn_to(Doing::Asking);
    r.gl.BeginQuery(GL_ANY_SAMPLES_PASSED, r.queries[asked_++]);
    r.gl.DrawArrays(GL_TRIANGLES, static_cast<GLint>(6 * prism), 6);
    r.gl.EndQuery(GL_ANY_SAMPLES_PASSED);
}

void GlCanvas::draw(Index prism) {
    turn_to(Doing::Drawing);
    resources_->gl.DrawArrays(GL_TRIANGLES, static_cast<GLint>(6 * prism), 6);
}

void GlCanvas::collect() {
    for (std::size_t q = 0; q < asked_; ++q) {
        GLuint passed = 1; // what a lost context leaves here keeps the prism
        resources_->gl.GetQueryObjectuiv(resources_->queries[q], GL_QUERY_RESULT, &passed);
        behind_.push_back(passed != 0);
    }
    asked_ = 0;
}

Result<void> GlCanvas::answer(std::vector<std::uint8_t>& behind) {
    collect();
    behind.assign(behind_.begin(), behind_.end());
    behind_.clear();
    return check("asking for visibility");
}

} // namespace trocar::engine
