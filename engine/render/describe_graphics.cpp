#include "engine/render/describe_graphics.hpp"

#include "engine/render/gl_cull_backend.hpp"
#include "engine/step/instrument/cull_stage.hpp"

#include <fmt/format.h>

namespace trocar::engine {

namespace {

/// Why `auto` leaves it out: at best all candidates of a step are spared their tests.
std::string price_of(const CullCostModel::Rates& rates) {
    return fmt::format("\"auto\" leaves it out: {:.2g} us a candidate, and a test that is spared takes {:.2g} us", 1e6 * rates.culling_s_per_item,
                       1e6 * rates.test_s_per_item);
}

} // namespace

std::vector<GraphicsLine> describe_graphics(const ContextOptions& options) {
    const auto context = make_context(options);
    if (!context.ok()) return {{"none", context.error().message}, {"culling", "by the CPU reference; " + price_of(kCpuReferenceRates)}};
    std::vector<GraphicsLine> lines;
    for (const ContextAttempt& attempt : (*context)->attempts())
        lines.push_back({name_of(attempt.kind),
                         attempt.reason.empty() ? fmt::format("taken: {}, OpenGL {}", (*context)->renderer_name(), (*context)->version())
                                                : attempt.reason});
    const auto culler = GlCullBackend::make(options);
    if (!culler.ok())
        lines.push_back({"culling", "by the CPU reference: " + culler.error().message + "; " + price_of(kCpuReferenceRates)});
    else if ((*culler)->is_software())
        lines.push_back({"culling", "possible, but drawn by software: the CPU reference is used unless OpenGL is asked for; " + price_of(kCpuReferenceRates)});
    else
        lines.push_back({"culling", fmt::format("in layers of {0} x {0} pixels", (*culler)->preferred_resolution())});
    return lines;
}

} // namespace trocar::engine
