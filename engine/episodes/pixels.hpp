// X-ray pictures as observations of environments. What a picture shows follows from the state alone, its noise too.
#pragma once

#include "engine/fluoroscopy/observation.hpp"

#include <memory>
#include <string>
#include <vector>

namespace trocar::engine {

/// 8 bits each. Depth: 255 is the source-detector distance, 0 where no body is met.
enum class PixelChannel : std::uint8_t { Image, Device, Vessel, Depth };

struct PixelOptions {
    std::string view;                          // of the scene's outputs.fluoroscopy; empty: its first, or the whole patient from the front
    std::array<unsigned, 2> pixels{128, 128};  // columns, rows, on the view's detector
    std::vector<PixelChannel> channels;        // of an observation; empty: pictures are taken only when they are asked for
    [[nodiscard]] std::size_t size() const noexcept { return std::size_t{pixels[0]} * pixels[1] * channels.size(); }
};

/// Pixels along an edge.
inline constexpr unsigned kLeastPixelEdge = 8, kMostPixelEdge = 2048;

/// A C-arm for one environment in one scene. A copy has what never moves projected already.
class PixelCamera {
public:
    /// prepared  outlives the camera and its copies
    /// fails     BadValue: no such view, a picture of no pixels or too many, a source inside a body
    [[nodiscard]] static Result<PixelCamera> make(const Scene& scene, const PreparedScene& prepared, const PixelOptions& options);

    /// A subtraction's mask is the next picture.
    void begin_episode();
    /// frame    of which the noise follows
    /// pixels   [rows][columns][channels]      tips   [instruments][2] pixels
    void take(const State& state, std::uint64_t frame, std::uint8_t* pixels, double* tips);
    [[nodiscard]] XrayObservation observe_all(const State& state, std::uint64_t frame);

    [[nodiscard]] const PixelOptions& options() const noexcept { return options_; }

private:
    PixelCamera(const Scene& scene, const PreparedScene& prepared, const XrayView& view, PixelOptions options);

    const SceneModel* model_;
    PixelOptions options_;
    std::shared_ptr<const FluoroscopySpec> spec_;
    std::shared_ptr<const XrayView> view_;
    XrayPatient patient_;
    Fluoroscope scope_;
};

} // namespace trocar::engine
