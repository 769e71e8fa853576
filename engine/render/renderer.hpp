// Headless pictures of a simulated state: a shaded view with transparent organs, and an X-ray (fluoroscopy) view.
#pragma once

#include "base/result.hpp"
#include "engine/render/camera.hpp"
#include "engine/render/context.hpp"
#include "engine/render/picture.hpp"
#include "engine/render/render_scene.hpp"

#include <memory>

namespace trocar::engine {

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
