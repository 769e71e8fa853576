#include "engine/prepare/chromatic_report.hpp"

#include "engine/time/clock.hpp"

namespace trocar::engine {

ChromaticReport report_chromatic(std::span<const Triangle> triangles, std::size_t vertex_count, collision::ChromaticSets* sets) {
    const StopWatch watch;
    collision::ChromaticSets made = collision::make_chromatic_sets(triangles, vertex_count);
    const ChromaticReport report{made.count(), 1e-3 * watch.elapsed_ms(), made.from_grid, made.hub_triangles};
    if (sets != nullptr) *sets = std::move(made);
    return report;
}

} // namespace trocar::engine
