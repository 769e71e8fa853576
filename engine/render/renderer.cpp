#include "engine/render/renderer.hpp"

#include "engine/render/overlay.hpp"
#include "engine/render/passes.hpp"

#include <fmt/format.h>

namespace trocar::engine {
namespace {

constexpr int kMinSide = 16;   // pixels
constexpr int kMaxSide = 8192; // two samples a pixel reach the usual limit of 16384

} // namespace

struct Renderer::Parts {
    std::unique_ptr<GlContext> context; // frees the programs with it
    Programs programs;

    using Draw = Result<void> (*)(const PassContext&, Picture&);
    [[nodiscard]] Result<Picture> render(const RenderScene& scene, const Projection& view, bool thicken, Draw draw);
};

Renderer::Renderer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Renderer::~Renderer() = default;
const GlContext& Renderer::context() const noexcept { return *parts_->context; }

Result<std::unique_ptr<Renderer>> Renderer::make(const ContextOptions& options) {
    Result<std::unique_ptr<GlContext>> context = make_context(options);
    if (!context) return context.error();
    auto parts = std::make_unique<Parts>();
    parts->context = std::move(context).value();
    {
        const CurrentContext current(*parts->context);
        if (!current.ok()) return Error{ErrorCode::ToolFailed, "the graphics context was lost"};
        const Result<Programs> programs = make_programs(parts->context->api());
        if (!programs) return programs.error();
        parts->programs = *programs;
    }
    return std::unique_ptr<Renderer>(new Renderer(std::move(parts)));
}

Result<Picture> Renderer::Parts::render(const RenderScene& scene, const Projection& view, bool thicken, Draw draw_picture) {
    if (std::min(view.width, view.height) < kMinSide || std::max(view.width, view.height) > kMaxSide)
        return Error{ErrorCode::BadValue,
                     fmt::format("a picture of {} x {} pixels; both sides must be {} to {}", view.width, view.height, kMinSide, kMaxSide)};
    const CurrentContext current(*context);
    if (!current.ok()) return Error{ErrorCode::ToolFailed, "the graphics context was lost"};
    const GlApi& gl = context->api();
    gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    Picture picture;
    picture.width = view.width;
    picture.height = view.height;
    picture.rgb.resize(3 * static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));

    const GlVertexArray empty_layout(gl);
    const std::vector<DrawItem> items = upload(gl, scene, view, thicken);
    const Result<void> drawn = draw_picture({gl, programs, view, items, empty_layout.name()}, picture);
    if (!drawn) return drawn.error();
    return picture;
}

Result<Picture> Renderer::shaded(const RenderScene& scene, const Camera& camera, int width, int height) {
    const Projection view = make_projection(camera, find_bounds(scene), width, height);
    Result<Picture> picture = parts_->render(scene, view, true, draw_shaded);
    if (!picture) return picture;
    draw_targets(scene, view, *picture);
    draw_markers(scene, view, *picture);
    if (scene.colour_bar && !scene.markers.empty()) draw_colour_bar(scene, *picture);
    if (scene.scale_bar) draw_scale_bar(view, (camera.look_at - camera.eye).dot(view.forward), *picture);
    return picture;
}

Result<Picture> Renderer::fluoroscopy(const RenderScene& scene, const Camera& camera, int width, int height) {
    const Projection view = make_projection(camera, find_bounds(scene), width, height);
    Result<Picture> picture = parts_->render(scene, view, false, draw_fluoroscopy);
    if (!picture) return picture;
    draw_target_rings(scene, view, *picture);
    if (scene.scale_bar) draw_scale_bar(view, (camera.look_at - camera.eye).dot(view.forward), *picture);
    return picture;
}

} // namespace trocar::engine
