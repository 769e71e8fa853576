#include "engine/render/culled_search.hpp"

#include "collision/culling/cull_twin.hpp"
#include "engine/render/gl_canvas.hpp"
#include "engine/render/gl_cull_backend.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

CulledSearch::CulledSearch(std::span<const collision::SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
                           const Options& options)
    : options_(options), trees_(surfaces.size()) {
    for (std::size_t i = 0; i < surfaces.size(); ++i) trees_[i].build(*surfaces[i], positions[i]);
    for (Index a = 0; a < surfaces.size(); ++a)
        for (Index b = a; b < surfaces.size(); ++b) {
            if (!(a == b ? options.within : options.between)) continue;
            jobs_.push_back({a,
                             b,
                             a == b ? std::make_unique<collision::ChromaticCuller>(*surfaces[a])
                                    : std::make_unique<collision::ChromaticCuller>(*surfaces[a], *surfaces[b]),
                             {}});
        }
    if (options.method == CullMethod::Gl) {
        auto gl = GlCullBackend::make(options.contexts);
        if (gl.ok())
            backend_ = std::move(gl).value();
        else
            notes_.push_back("culling on the CPU instead of OpenGL: " + gl.error().message);
    }
    if (options.method == CullMethod::Query) {
        auto gl = GlCanvas::make(options.contexts);
        if (gl.ok())
            canvas_ = std::move(gl).value();
        else
            notes_.push_back("queries by the CPU instead of OpenGL: " + gl.error().message);
        if (!canvas_) canvas_ = std::make_unique<collision::CpuCanvas>();
        return;
    }
    if (!backend_ && options.method != CullMethod::None) backend_ = std::make_unique<collision::CpuCullBackend>();
}

Index CulledSearch::colours() const noexcept {
    Index most = 0;
    for (const Job& job : jobs_)
        if (job.a == job.b) most = std::max(most, job.culler->set_count());
    return most;
}

void CulledSearch::note_tests(double ms) noexcept {
    std::size_t pairs = 0;
    for (const Job& job : jobs_) pairs += job.culler->counts().left_pairs;
    cost_.note_tests(pairs, 1e-3 * ms);
}

std::string CulledSearch::backend() const { return canvas_ ? canvas_->name() : backend_ ? backend_->name() : "none"; }

void CulledSearch::note_memory(const collision::CullReport& report) {
    if (report.lowered_for_memory == 0) return;
    notes_.push_back(fmt::format("{} has no memory for larger pictures: {} x {} pixels", backend(), report.resolution, report.resolution));
}

void CulledSearch::cull_by_queries(collision::ChromaticCuller& culler) {
    auto done = culler.look(options_.queries, *canvas_);
    if (done.ok()) return;
    notes_.push_back("queries by the CPU from here on: " + done.error().message);
    canvas_ = std::make_unique<collision::CpuCanvas>();
    done = culler.look(options_.queries, *canvas_); // cannot fail
}

void CulledSearch::look(collision::ChromaticCuller& culler) {
    if (canvas_) return cull_by_queries(culler);
    auto done = culler.look(options_.plan, *backend_);
    note_memory(culler.counts().pictures);
    if (done.ok()) return;
    notes_.push_back("culling on the CPU from here on: " + done.error().message);
    backend_ = std::make_unique<collision::CpuCullBackend>();
    done = culler.look(options_.plan, *backend_); // cannot fail
}

CullTimes CulledSearch::find_candidates(std::span<const collision::SurfaceMotion> motions) {
    CullTimes times;
    StopWatch watch;
    for (std::size_t i = 0; i < trees_.size(); ++i) trees_[i].refit(motions[i]);
    times.refit_ms = watch.lap_ms();
    std::size_t near = 0, left = 0;
    for (Job& job : jobs_) {
        job.culler->find_near(motions[job.a], trees_[job.a], motions[job.b], trees_[job.b], options_.distance, options_.tolerance);
        near += job.culler->counts().near_pairs;
    }
    times.near_ms = watch.lap_ms();
    stage_two_ran_ = canvas_ || (backend_ && (options_.method != CullMethod::Auto || !measured_ || cost_.pays(near)));
    if (stage_two_ran_)
        for (Job& job : jobs_) {
            look(*job.culler);
            left += job.culler->counts().left_pairs;
        }
    times.look_ms = watch.lap_ms();
    if (stage_two_ran_) {
        cost_.note_culling(near, left, 1e-3 * times.look_ms);
        measured_ = measured_ || near > 0;
    } else {
        cost_.pass_over();
    }
    for (Job& job : jobs_) job.culler->find_candidates(job.candidates);
    times.collect_ms = watch.lap_ms();
    return times;
}

} // namespace trocar::engine
