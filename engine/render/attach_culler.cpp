#include "engine/render/attach_culler.hpp"

#include "engine/prepare/model.hpp"
#include "engine/render/gl_cull_backend.hpp"

namespace trocar::engine {

namespace {

/// Null: the CPU reference, or none.
struct FoundCuller {
    std::unique_ptr<collision::CullBackend> device;
    std::string words;
};

FoundCuller find_culler(const SceneModel& model, const ContextOptions& options) {
    const Culling asked = model.contact.culling;
    if (model.instruments.empty() || !model.effects.exact_contact || asked == Culling::Never || asked == Culling::Cpu) return {};
    auto device = GlCullBackend::make(options);
    if (!device.ok()) return {nullptr, asked == Culling::OpenGl ? "culling by the CPU reference instead of OpenGL: " + device.error().message : ""};
    if (asked == Culling::Auto && (*device)->is_software()) return {};
    std::string words = "culling by " + (*device)->name();
    return {std::move(device).value(), std::move(words)};
}

} // namespace

std::string describe_culler(const SceneModel& model, const ContextOptions& options) { return find_culler(model, options).words; }

std::string attach_culler(Simulator& simulator, const ContextOptions& options) {
    FoundCuller found = find_culler(simulator.model(), options);
    if (found.device) simulator.set_cull_device(std::move(found.device));
    return found.words;
}

} // namespace trocar::engine
