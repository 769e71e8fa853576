#include "engine/report/photographer.hpp"

#include "engine/render/orientation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

const char* view_name(PictureView view) noexcept {
    switch (view) {
    case PictureView::Anatomy:
        return "anatomy";
    case PictureView::Tip:
        return "tip";
    case PictureView::Fluoroscopy:
        return "fluoro";
    }
    return "";
}

Photographer::Photographer(const Scene& scene, std::filesystem::path folder)
    : folder_(std::move(folder)), wanted_(scene.outputs.pictures), tolerance_(1e-6 * scene.time.step), width_(scene.outputs.width),
      height_(scene.outputs.height) {
    const bool has_fluoroscopy =
        std::any_of(wanted_.begin(), wanted_.end(), [](const PictureSpec& picture) { return picture.view == PictureView::Fluoroscopy; });
    if (scene.effects.fluoroscopy && !has_fluoroscopy) wanted_.push_back({PictureView::Fluoroscopy, scene.time.duration});
    std::stable_sort(wanted_.begin(), wanted_.end(), [](const PictureSpec& a, const PictureSpec& b) { return a.time < b.time; });
}

bool Photographer::anything_due(double time) const noexcept {
    return !given_up_ && next_ < wanted_.size() && wanted_[next_].time <= time + tolerance_;
}

void Photographer::skip_until(double time) noexcept {
    while (anything_due(time)) ++next_;
}

void Photographer::take_due(const Moment& moment, double time, std::vector<std::string>& notices) {
    while (anything_due(time)) take(wanted_[next_++].view, moment, time, notices);
}

void Photographer::take_rest(const Moment& moment, double time, std::vector<std::string>& notices) {
    const auto is_taken = [&](PictureView view) { // of this very moment
        return std::any_of(taken_.begin(), taken_.end(), [&](const auto& taken) { return taken.view == view && std::abs(taken.time - time) <= tolerance_; });
    };
    std::vector<PictureView> views;
    for (; next_ < wanted_.size(); ++next_) {
        const PictureView view = wanted_[next_].view;
        if (std::find(views.begin(), views.end(), view) == views.end() && !is_taken(view)) views.push_back(view);
    }
    for (const PictureView view : views) take(view, moment, time, notices);
}

void Photographer::take(PictureView view, const Moment& moment, double time, std::vector<std::string>& notices) {
    if (given_up_) return;
    if (!renderer_) {
        Result<std::unique_ptr<Renderer>> renderer = Renderer::make();
        if (!renderer) {
            give_up(renderer.error().to_string(), notices);
            return;
        }
        renderer_ = std::move(*renderer);
    }
    const View shown = make_view(view, moment, width_, height_);
    const int width = static_cast<int>(width_), height = static_cast<int>(height_);
    Result<Picture> picture = view == PictureView::Fluoroscopy ? renderer_->fluoroscopy(shown.scene, shown.camera, width, height)
                                                                     : renderer_->shaded(shown.scene, shown.camera, width, height);
    if (!picture) {
        give_up(picture.error().to_string(), notices);
        return;
    }
    const ViewAxes axes = make_view_axes(shown.camera.look_at - shown.camera.eye, shown.camera.up);
    draw_orientation_cube(axes, *picture);
    draw_edge_letters(axes, *picture);
    const std::string file = fmt::format("{}_{:02}_t{:05.2f}s.png", view_name(view), taken_.size() + failed_.size() + 1, time);
    if (Result<void> written = write_png(folder_ / file, *picture); !written)
        failed_.push_back(written.error());
    else
        taken_.push_back({view, time, file});
}

void Photographer::give_up(const std::string& reason, std::vector<std::string>& notices) {
    given_up_ = true;
    renderer_.reset();
    notices.push_back("no pictures: " + reason);
}

std::string Photographer::renderer_name() const {
    if (!renderer_) return {};
    const GlContext& context = renderer_->context();
    return fmt::format("{}, OpenGL {}, by {}", context.renderer_name(), context.version(), name_of(context.kind()));
}

} // namespace trocar::engine
