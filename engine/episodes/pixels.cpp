#include "engine/episodes/pixels.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

Error refuse(std::string message, std::string key) { return {ErrorCode::BadValue, std::move(message), {}, 0, 0, std::move(key)}; }

Result<XrayView> find_view(const Scene& scene, const SceneModel& model, const State& state, const PixelOptions& options) {
    const std::vector<XrayView> none;
    const std::vector<XrayView>& views = scene.outputs.fluoroscopy ? scene.outputs.fluoroscopy->views : none;
    if (options.view.empty() && views.empty()) {
        XrayView view = XrayPatient::whole_view(model, state, options.pixels);
        view.display = XrayDisplay::Log;
        return view;
    }
    std::string known;
    for (const XrayView& view : views) {
        if (options.view.empty() || view.name == options.view) return view;
        known += (known.empty() ? "\"" : ", \"") + view.name + "\"";
    }
    return refuse(fmt::format("found \"{:.60}\", expected {}", options.view, known.empty() ? "none: the scene has no views in outputs.fluoroscopy" : "one of " + known),
                  "view");
}

} // namespace

PixelCamera::PixelCamera(const Scene& scene, const PreparedScene& prepared, const XrayView& view, PixelOptions options)
    : model_(&prepared.model), options_(std::move(options)),
      spec_(std::make_shared<const FluoroscopySpec>(scene.outputs.fluoroscopy.value_or(FluoroscopySpec{}))), view_(std::make_shared<const XrayView>(view)),
      patient_(*spec_, prepared.model), scope_(*view_) {}

Result<PixelCamera> PixelCamera::make(const Scene& scene, const PreparedScene& prepared, const PixelOptions& options) {
    for (const unsigned edge : options.pixels)
        if (edge < kLeastPixelEdge || edge > kMostPixelEdge)
            return refuse(fmt::format("found {} x {}, expected {} to {} along each edge", options.pixels[0], options.pixels[1], kLeastPixelEdge, kMostPixelEdge), "pixels");
    const State start = make_initial_state(prepared.model);
    Result<XrayView> view = find_view(scene, prepared.model, start, options);
    if (!view) return view.error();
    view->pixels = options.pixels;
    view->bits = 8;
    PixelCamera camera(scene, prepared, *view, options);
    if (Result<void> outside = camera.patient_.check_source(start, *view); !outside) return outside.error();
    (void)camera.observe_all(start, 0); // the window is the start's, for every episode; what stands still is projected
    return camera;
}

void PixelCamera::begin_episode() {
    scope_.console().mask.clear();
    scope_.console().filled.clear();
}

void PixelCamera::take(const State& state, std::uint64_t frame, std::uint8_t* pixels, double* tips) {
    const XrayFrame& now = scope_.project(patient_, state);
    const std::size_t step = options_.channels.size();
    for (std::size_t c = 0; c < step; ++c) {
        const PixelChannel channel = options_.channels[c];
        const GreyFrame grey = channel == PixelChannel::Image    ? scope_.frame(frame, state.time)
                               : channel == PixelChannel::Device ? scope_.device_mask()
                               : channel == PixelChannel::Vessel ? scope_.vessel_mask(patient_, state)
                                                                 : scope_.depth(patient_, state);
        const unsigned shift = grey.bits - 8;
        for (std::size_t k = 0; k < grey.values.size(); ++k) pixels[k * step + c] = static_cast<std::uint8_t>(grey.values[k] >> shift);
    }
    const XrayProjection projection = now.beam.projection();
    for (std::size_t i = 0; i < state.instruments.size(); ++i) {
        const PixelPlace tip = place_in_picture(projection, state.instruments[i].rod.position.back());
        std::copy(tip.begin(), tip.end(), tips + 2 * i);
    }
}

XrayObservation PixelCamera::observe_all(const State& state, std::uint64_t frame) {
    return observe(scope_, patient_, *model_, state, frame);
}

} // namespace trocar::engine
