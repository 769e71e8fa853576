#include "engine/render/describe_graphics.hpp"

#include "engine/render/gl_cull_backend.hpp"
#include "engine/step/instrument/cull_stage.hpp"

#include <fmt/format.h>

namespace trocar::engine {

namespace {

/// What "auto" goes by until it has measured.
std::string describe_cpu_reference() {
    const CullCostModel model(kCpuReferenceRates);
    return fmt::format("the CPU reference, {} by \"auto\": {:.2g} us a candidate, {:.2g} us for a test that is spared",
                       model.pays(kReservedCullCandidates) ? "taken for many candidates" : "left out", 1e6 * kCpuReferenceRates.culling_s_per_item,
                       1e6 * kCpuReferenceRates.test_s_per_item);
}

} // namespace

std::vector<GraphicsLine> describe_graphics(const ContextOptions& options) {
    const auto context = make_context(options);
    if (!context.ok()) return {{"none", context.error().message}, {"culling", "by " + describe_cpu_reference()}};
    std::vector<GraphicsLine> lines;
    for (const ContextAttempt& attempt : (*context)->attempts())
        lines.push_back({name_of(attempt.kind),
                         attempt.reason.empty() ? fmt::format("taken: {}, OpenGL {}", (*context)->renderer_name(), (*context)->version())
                                                : attempt.reason});
    const auto culler = GlCullBackend::make(options);
    if (!culler.ok())
        lines.push_back({"culling", "by " + describe_cpu_reference() + "; " + culler.error().message});
    else if ((*culler)->is_software())
        lines.push_back({"culling", "drawn by software where OpenGL is asked for; else by " + describe_cpu_reference()});
    else
        lines.push_back({"culling", fmt::format("in layers of {0} x {0} pixels", (*culler)->preferred_resolution())});
    return lines;
}

} // namespace trocar::engine
