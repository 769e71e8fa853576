// Candidates by set-based culling, for surfaces against themselves and each other: the culler of collision/, its backend chosen at run
// time, and a clock for every stage. Where graphics hardware is requested and missing, or fails, the CPU reference does the work, and a
// note says so.
#pragma once

#include "collision/culling/chromatic_culler.hpp"
#include "engine/render/context.hpp"
#include "engine/time/cull_cost.hpp"

#include <memory>
#include <string>

namespace trocar::engine {

enum class CullMethod : std::uint8_t {
    None,  // stages I, III and IV
    Cpu,   // stage II by the CPU reference
    Gl,    // stage II by OpenGL
    Query, // stage II in the order of Govindaraju et al. 2005, by OpenGL's occlusion queries
    Auto,  // by the CPU reference, in steps where it is predicted to pay
};

struct CullTimes {
    double refit_ms = 0.0, near_ms = 0.0, look_ms = 0.0, collect_ms = 0.0; // trees; stages I; II; what III and IV will test
};

class CulledSearch {
public:
    struct Options {
        CullMethod method = CullMethod::Cpu;
        bool within = true, between = true;
        double distance = 0.0, tolerance = 0.0; // m
        collision::CullPlan plan = {};
        collision::QueryPlan queries = {};
        ContextOptions contexts = {};
    };
    /// surfaces, positions   as for ContactSearch::build; the topologies must outlive this
    CulledSearch(std::span<const collision::SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
                 const Options& options);

    struct Job {
        Index a = 0, b = 0; // surfaces; the same one: against itself
        std::unique_ptr<collision::ChromaticCuller> culler;
        collision::CulledCandidates candidates;
    };
    /// Candidates of one step, into jobs().
    CullTimes find_candidates(std::span<const collision::SurfaceMotion> motions);
    /// What the elementary tests of these candidates took: for CullMethod::Auto.
    void note_tests(double ms) noexcept;

    [[nodiscard]] std::span<const Job> jobs() const noexcept { return jobs_; }
    [[nodiscard]] Index colours() const noexcept; // sets of the surface that has most
    [[nodiscard]] std::string backend() const;
    [[nodiscard]] const std::vector<std::string>& notes() const noexcept { return notes_; }
    [[nodiscard]] bool looked() const noexcept { return stage_two_ran_; } // did stage II run in the last step?

private:
    void look(collision::ChromaticCuller& culler);
    void cull_by_queries(collision::ChromaticCuller& culler);
    void note_memory(const collision::CullReport& report);

    Options options_;
    std::vector<collision::BoxTree> trees_;
    std::vector<Job> jobs_;
    std::unique_ptr<collision::CullBackend> backend_;
    std::unique_ptr<collision::VisibilityCanvas> canvas_; // CullMethod::Query
    CullCostModel cost_{{}}; // no declared rates: the first step is culled, so that there is a measurement to predict from
    bool measured_ = false;
    std::vector<std::string> notes_;
    bool stage_two_ran_ = false;
};

} // namespace trocar::engine
