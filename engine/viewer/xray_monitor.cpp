#include "engine/viewer/xray_monitor.hpp"

#include "engine/fluoroscopy/fluoroscope.hpp"
#include "engine/time/clock.hpp"
#include "engine/viewer/frame.hpp"
#include "engine/viewer/loop.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace trocar::engine::viewer {

namespace {

/// ns between two pictures at least: 15 a second, as angiography suites pulse; 30 while the arm moves.
constexpr std::int64_t kPulse = 66'000'000, kQuickPulse = 33'000'000;
/// ns between two looks for a new state.
constexpr std::int64_t kNap = 3'000'000;
constexpr unsigned kWholeEdge = 512;
/// Of a pixel in the open beam, where the scene has no view of its own: a fluoroscopy's picture, and the higher dose of one that is subtracted.
constexpr double kPhotons = 4000.0, kSubtractionDose = 8.0;

XrayView first_view(const Scene& scene, const SceneModel& model, const State& state) {
    if (scene.outputs.fluoroscopy && !scene.outputs.fluoroscopy->views.empty()) {
        XrayView view = scene.outputs.fluoroscopy->views.front();
        view.arm.clear();
        view.window.reset();
        view.mask = 0.0;
        return view;
    }
    XrayView view = XrayPatient::whole_view(model, state, {kWholeEdge, kWholeEdge});
    view.noise = true;
    view.photons = kPhotons;
    return view;
}

template <class T>
void put(std::string& out, T value) {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof(T));
    out.append(bytes.data(), bytes.size());
}

} // namespace

/// The arm as it stands, and the console's memory of what it has shown.
class XrayMonitor::Screen {
public:
    Screen(const Scene& scene, const SceneModel& model, const State& state)
        : spec_(scene.outputs.fluoroscopy.value_or(FluoroscopySpec{})), patient_(spec_, model), base_(first_view(scene, model, state)), view_(base_) {}

    /// Stands the arm as it is wanted; a mask that another stand took is none any more.
    void set(const Wishes& wishes, const State& state) {
        const XraySettings& to = wishes.settings;
        if (wishes.set != set_) {
            const bool moves = !scope_ || to.primary != settings_.primary || to.secondary != settings_.secondary || to.zoom != settings_.zoom ||
                               to.edge != settings_.edge || to.at_tip || settings_.at_tip;
            settings_ = to;
            set_ = wishes.set;
            if (moves) stand(state);
            if (!moves) scope_->console().window.reset();
            view_.display = to.display;
            view_.photons = base_.photons * (to.display == XrayDisplay::Subtraction ? kSubtractionDose : 1.0);
        }
        if (!scope_) stand(state);
        if (wishes.masks != masks_ || state.time < last_time_) { // another run begins
            masks_ = wishes.masks;
            begin_console();
        }
        last_time_ = state.time;
    }

    [[nodiscard]] std::string picture(const State& state, std::uint32_t number) {
        const std::int64_t began = monotonic_ns();
        const XrayFrame& projected = scope_->project(patient_, state);
        const GreyFrame frame = scope_->frame(state.step, state.time);
        const auto tip = state.instruments.empty() ? std::nullopt : project(projected.beam.projection(), state.instruments.front().rod.position.back());
        unsigned flags = projected.contrast.empty() ? 0 : kXrayHasContrast;
        if (source_inside_) flags |= kXraySourceInside;
        if (mask_is_new_) flags |= kXrayNewMask;
        mask_is_new_ = false;
        constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
        std::string out;
        out.reserve(64 + frame.values.size());
        put(out, kXrayMessage), put(out, kWireVersion), put(out, static_cast<std::uint16_t>(flags)), put(out, number);
        put(out, static_cast<std::uint16_t>(frame.width)), put(out, static_cast<std::uint16_t>(frame.height));
        put(out, static_cast<std::uint32_t>(view_.display)), put(out, state.time);
        for (const double value : {view_.primary, view_.secondary}) put(out, static_cast<float>(value));
        for (std::size_t k = 0; k < 2; ++k) put(out, tip ? static_cast<float>((*tip)[k]) : kNone);
        put(out, static_cast<float>(settings_.zoom)), put(out, static_cast<float>(1e-6 * static_cast<double>(monotonic_ns() - began)));
        for (const std::uint16_t value : frame.values) out.push_back(static_cast<char>(value));
        return out;
    }

private:
    void stand(const State& state) {
        view_ = base_;
        view_.primary = settings_.primary, view_.secondary = settings_.secondary;
        view_.bits = 8;
        view_.display = settings_.display;
        const double scale = static_cast<double>(settings_.edge) / std::max(base_.pixels[0], base_.pixels[1]);
        for (std::size_t k = 0; k < 2; ++k) {
            view_.pixels[k] = std::max(1u, static_cast<unsigned>(std::lround(base_.pixels[k] * scale)));
            view_.detector[k] = base_.detector[k] / settings_.zoom;
        }
        view_.photons = base_.photons;
        if (settings_.at_tip && !state.instruments.empty()) view_.table = view_.isocentre - state.instruments.front().rod.position.back();
        scope_.emplace(view_);
        source_inside_ = patient_.find_around(state, make_cone_beam(view_, {view_.primary, view_.secondary}).source) != nullptr;
        mask_is_new_ = true;
    }
    void begin_console() {
        scope_->console() = {};
        mask_is_new_ = true;
    }

    FluoroscopySpec spec_;
    XrayPatient patient_;
    XrayView base_, view_;
    XraySettings settings_;
    std::optional<Fluoroscope> scope_; // of view_
    unsigned set_ = 0, masks_ = 0;
    double last_time_ = 0.0;
    bool source_inside_ = false, mask_is_new_ = true;
};

XrayMonitor::XrayMonitor(const Scene& scene, const SceneModel& model, Exchange& exchange)
    : scene_(scene), model_(model), exchange_(exchange), thread_([this] { run(); }) {}

XrayMonitor::~XrayMonitor() {
    {
        const std::lock_guard lock(mutex_);
        wishes_.stop = true;
    }
    changed_.notify_one();
    thread_.join();
}

void XrayMonitor::show(bool on) {
    const std::lock_guard lock(mutex_);
    wishes_.shown = on;
    changed_.notify_one();
}

void XrayMonitor::set(const XraySettings& settings) {
    const std::lock_guard lock(mutex_);
    wishes_.settings = settings;
    ++wishes_.set;
}

void XrayMonitor::take_mask() {
    const std::lock_guard lock(mutex_);
    ++wishes_.masks;
}

std::shared_ptr<const std::string> XrayMonitor::take() { return pictures_.take() ? pictures_.front() : nullptr; }

void XrayMonitor::run() {
    std::optional<Screen> screen;
    Wishes done; // what the last picture shows
    std::uint32_t number = 0;
    std::int64_t last = 0;
    bool has_state = false;
    for (;;) {
        Wishes wishes;
        {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [&] { return wishes_.shown || wishes_.stop; });
            wishes = wishes_;
        }
        if (wishes.stop) return;
        const bool is_asked = wishes.set != done.set || wishes.masks != done.masks;
        const std::int64_t now = monotonic_ns();
        if (now - last < (is_asked ? kQuickPulse : kPulse)) {
            wait_until_ns(now + kNap);
            continue;
        }
        const bool is_new = exchange_.xray.take();
        has_state = has_state || is_new;
        if (!has_state || (!is_new && !is_asked)) {
            wait_until_ns(now + kNap);
            continue;
        }
        const State& state = exchange_.xray.front();
        if (!screen) screen.emplace(scene_, model_, state);
        screen->set(wishes, state);
        pictures_.back() = std::make_shared<const std::string>(screen->picture(state, ++number));
        pictures_.publish();
        done = wishes;
        last = now;
    }
}

} // namespace trocar::engine::viewer
