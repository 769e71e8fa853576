#include "engine/render/attach_culler.hpp"

#include "engine/prepare/model.hpp"
#include "engine/render/gl_cull_backend.hpp"

namespace trocar::engine {

std::string attach_culler(Simulator& simulator, const ContextOptions& options) {
    const SceneModel& model = simulator.model();
    const Culling asked = model.contact.culling;
    if (model.instruments.empty() || !model.effects.exact_contact || asked == Culling::Never || asked == Culling::Cpu) return {};
    auto device = GlCullBackend::make(options);
    if (!device.ok()) return asked == Culling::OpenGl ? "culling by the CPU reference instead of OpenGL: " + device.error().message : "";
    if (asked == Culling::Auto && (*device)->is_software()) return {};
    std::string words = "culling by " + (*device)->name();
    simulator.set_cull_device(std::move(device).value());
    return words;
}

} // namespace trocar::engine
