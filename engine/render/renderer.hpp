// Headless pictures of a simulated state: a shaded view with transparent organs, and an X-ray (fluoroscopy) view.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/render/camera.hpp"
#include "engine/render/context.hpp"
#include "engine/render/picture.hpp"

#include <memory>
#include <span>
#include <vector>

namespace trocar::engine {

/// Colours that tell the parts of an intervention apart on the light background, sRGB, and the density of their walls in X-ray pictures.
namespace palette {
inline const Vec3 kLiver = Vec3(0.80, 0.42, 0.33);
inline const Vec3 kArtery = Vec3(0.86, 0.17, 0.17);
inline const Vec3 kVein = Vec3(0.28, 0.40, 0.72);
inline const Vec3 kInstrument = Vec3(0.05, 0.34, 0.90);
inline const Vec3 kTarget = Vec3(1.00, 0.62, 0.10);
inline const Vec3 kRigid = Vec3(0.80, 0.81, 0.83);
inline constexpr double kOrganOpacity = 0.30;
inline constexpr double kVesselOpacity = 0.42;
inline constexpr double kInstrumentEmphasis = 0.8;
inline constexpr double kOrganAttenuation = 2.0;     // 1/m, above the surrounding tissue
inline constexpr double kContrastAttenuation = 30.0; // 1/m, a vessel filled with diluted contrast agent
inline constexpr double kInstrumentAttenuation = 2500.0;
} // namespace palette

/// A triangle surface. Seen from both sides; closed ones should be oriented outwards.
struct RenderSurface {
    std::span<const Vec3> vertices;                  // [vertex_count] m, world; must outlive the call
    std::span<const Triangle> triangles;             // [triangle_count]; triangles with ids out of range or non-finite corners are left out
    Vec3 colour = Vec3(0.8, 0.8, 0.8);               // sRGB, 0..1
    double opacity = 1.0;                            // seen face-on; edges grow denser, as those of a thin shell. >= 1: opaque
    double emphasis = 0.0;                           // opaque surfaces: share of what lies in front that is left out, 0..1
    bool fluoro_thickness = true;                    // part of the X-ray picture: the surface is closed, its thickness attenuates
    double attenuation = palette::kOrganAttenuation; // 1/m, above what surrounds it
};

/// A round tube along a polyline, with round ends: a catheter before it has a skin, a planned path, a centreline.
struct RenderTube {
    std::span<const Vec3> points;       // [point_count] m; must outlive the call
    double radius = 0.001;              // m
    double min_radius_px = 0.0;         // shaded picture: drawn no thinner than this, so that a catheter is seen from afar
    Vec3 colour = palette::kInstrument; // sRGB, 0..1
    double opacity = 1.0;
    double emphasis = 0.0; // as RenderSurface
    bool fluoro_thickness = true;
    double attenuation = palette::kInstrumentAttenuation; // 1/m
};

/// A target: a small sphere with a halo that shines through whatever lies in front of it. A ring in the X-ray picture.
struct RenderTarget {
    Vec3 position = Vec3::Zero(); // m
    double radius = 0.003;        // m
    Vec3 colour = palette::kTarget;
};

/// A contact, drawn as a dot over the picture in the colour of its depth.
struct RenderMarker {
    Vec3 position = Vec3::Zero(); // m
    double depth = 0.0;           // m, penetration; negative (apart) takes the colour of 0
};

struct RenderScene {
    std::vector<RenderSurface> surfaces;
    std::vector<RenderTube> tubes;
    std::vector<RenderTarget> targets;
    std::vector<RenderMarker> markers;
    double marker_range = 0.0;     // m, depth at the far end of the colour bar; 0: the next of 1, 2, 5 times a power of ten
    double marker_radius_px = 4.5; // at a picture height of 720; grows with it
    bool colour_bar = true;        // drawn when there are markers
    bool scale_bar = true;         // length at the depth of the camera's look_at
};

/// Owns a context, its programs and nothing else between calls. Not for two threads at once.
class Renderer {
public:
    /// failure  MissingTool without OpenGL 4.5, ToolFailed when a shader does not compile (with the driver's words)
    [[nodiscard]] static Result<std::unique_ptr<Renderer>> make(const ContextOptions& options = {});
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    [[nodiscard]] const GlContext& context() const noexcept;

    /// Lit picture on a light background. Transparency is exact: all layers of a pixel are sorted.
    /// failure  BadValue for a size that is not 16..8192, ToolFailed when the driver runs out of memory
    [[nodiscard]] Result<Picture> shaded(const RenderScene& scene, const Camera& camera, int width, int height);

    /// X-ray: Beer-Lambert over the summed thickness of all bodies with `fluoro_thickness`. Bodies must lie in front of the eye.
    [[nodiscard]] Result<Picture> fluoroscopy(const RenderScene& scene, const Camera& camera, int width, int height);

private:
    struct Parts;
    explicit Renderer(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> parts_;
};

} // namespace trocar::engine
