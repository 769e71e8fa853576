// Stage II of Govindaraju et al. 2005 on OpenGL: an occlusion query for each prism against a depth buffer.
#pragma once

#include "collision/culling/two_passes.hpp"
#include "engine/render/context.hpp"

#include <memory>

namespace trocar::engine {

class GlCanvas final : public collision::VisibilityCanvas {
public:
    /// fails   as GlCullBackend::make
    [[nodiscard]] static Result<std::unique_ptr<GlCanvas>> make(const ContextOptions& options = {});
    ~GlCanvas() override;

    [[nodiscard]] std::string name() const override; // "queries by EGL device: llvmpipe ..."
    [[nodiscard]] int preferred_resolution() const noexcept override;
    [[nodiscard]] const GlContext& context() const noexcept { return *context_; }

    [[nodiscard]] Result<void> start(const collision::CullJob& job) override;
    void clear() override;
    void ask(Index prism) override;
    void draw(Index prism) override;
    [[nodiscard]] Result<void> answer(std::vector<std::uint8_t>& behind) override;

private:
    enum class Doing : std::uint8_t { Nothing, Asking, Drawing };
    struct Resources;
    explicit GlCanvas(std::unique_ptr<GlContext> context);
    void turn_to(Doing what);
    void collect();
    [[nodiscard]] Result<void> check(const char* doing) const;

    std::unique_ptr<GlContext> context_;
    std::unique_ptr<Resources> resources_;
    std::unique_ptr<CurrentContext> current_; // from start() to the end, or to the next one
    std::vector<std::uint8_t> behind_;
    std::size_t asked_ = 0; // whose answers are still on the device
    Doing doing_ = Doing::Nothing;
};

} // namespace trocar::engine
