// Stage II on graphics hardware, or on Mesa's software renderers: per set a layer, per pixel the two nearest, a handful of draws a view.
#pragma once

#include "collision/culling/cull_backend.hpp"
#include "engine/render/context.hpp"

#include <memory>

namespace trocar::engine {

class GlCullBackend final : public collision::CullBackend {
public:
    /// The first way to OpenGL of `options.order` that can draw into the layers of a picture from a vertex shader.
    /// fails   MissingTool: no OpenGL, or not all that is needed; ToolFailed: the driver cannot compile a shader, with its log
    [[nodiscard]] static Result<std::unique_ptr<GlCullBackend>> make(const ContextOptions& options = {});
    ~GlCullBackend() override;

    [[nodiscard]] std::string name() const override;                  // "EGL device: llvmpipe ..."
    [[nodiscard]] int preferred_resolution() const noexcept override; // fewer pixels where no hardware draws them
    [[nodiscard]] bool is_software() const noexcept { return context_->is_software(); }
    [[nodiscard]] int largest_resolution() const noexcept override { return largest_resolution_; }
    [[nodiscard]] const GlContext& context() const noexcept { return *context_; }
    /// Layers that were drawn at once in the last call: all sets, or as many as memory held.
    [[nodiscard]] int layers() const noexcept { return layers_; }

    void reserve(std::size_t prisms, std::size_t questions, int resolution) override;
    /// fails   ToolFailed: the context was lost, or not even one layer fits into its memory (largest_resolution() is halved then)
    [[nodiscard]] Result<void> find_hits(const collision::CullJob& job, std::span<std::uint8_t> hits) override;

private:
    struct Resources;
    explicit GlCullBackend(std::unique_ptr<GlContext> context);
    [[nodiscard]] Result<void> prepare_targets(const collision::CullJob& job);
    void upload(const collision::CullJob& job);
    [[nodiscard]] Result<void> read_hits(std::span<std::uint8_t> hits);
    void draw_sets(const collision::CullJob& job, Index first, Index last);

    std::unique_ptr<GlContext> context_;
    std::unique_ptr<Resources> resources_;
    int layers_ = 0;
    int largest_resolution_ = collision::kLargestPicture;
};

} // namespace trocar::engine
