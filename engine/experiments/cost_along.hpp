// Every row of a table of costs along the states of the exact run: what would its answer have been there?
#pragma once

#include "engine/experiments/cost_exact.hpp"

#include <memory>

namespace trocar::engine {

/// Positions of the surfaces after a step's answer. An instrument moves within the step. Tissue feels the answer's contact springs in the
/// step after it: that one is begun from the state that the answer left, which differs from the exact run's in this answer alone.
class LookAhead {
public:
    explicit LookAhead(const SceneModel& model) : simulator_(model, BudgetLimits{}) {}
    /// The exact run, between two steps: what answers of its last step are compared with.
    void set_exact(Simulator& exact);
    /// answered  has taken the exact run's last step from the same state
    [[nodiscard]] SurfaceDistance compare(Simulator& answered);
    /// The tissue's next step after the answer, with the forces of contact between solids that it leads to.
    [[nodiscard]] const State& step_after(Simulator& answered);

private:
    [[nodiscard]] Shape follow(Simulator& answered);
    Simulator simulator_;
    Shape exact_;
};

class AlongExactStates {
public:
    /// Fills what `table.rows` were answered; all but `options` outlives it.
    AlongExactStates(const SceneModel& model, const CostSpec& cost, const CostOptions& options, CostTable& table);

    /// False: the exact run is stopped. `show` is called for every row's answer, unless empty.
    bool step(const std::function<void(const CostRow&, Simulator&)>& show);
    /// After a step.
    void compare_surfaces();
    /// After the last step.
    void finish();

private:
    /// Sums over the steps of one budget along the exact states.
    struct Along {
        std::unique_ptr<Simulator> simulator;
        PatchFinder* finder = nullptr; // of its model: patches beneath spheres are those of its trees
        bool other_trees = false;      // than the exact run's: what lies beneath a leaf of those is nothing to compare with
        double open = 0.0, leaves = 0.0, levels = 0.0, assumed = 0.0, force_sq = 0.0;
        std::uint64_t steps = 0;

        void finish(double exact_force_sq, CostAlong& row) const;
    };

    [[nodiscard]] PatchContacts solids_of(const PatchContacts& near, const PatchContacts& reference) const;
    void count_uncovered(const PatchContacts& near, const PatchContacts& reference);
    void compare(Along& along, const PatchContacts& reference, CostRow& row);

    CostTable& table_;
    PatchFinder finder_;
    std::vector<PatchFinder> variant_finders_;
    Simulator exact_;
    State start_; // of the step
    LookAhead ahead_;
    std::vector<Along> along_;
    std::vector<Vec3> exact_forces_, forces_;
    double exact_force_sq_ = 0.0, near_excess_sq_ = 0.0;
    std::vector<PatchId> named_; // of a step, by any answer
    std::uint64_t steps_ = 0, near_covered_ = 0, depth_patches_ = 0;
};

/// The scene's own model, or that of the row's variant.
[[nodiscard]] const SceneModel& model_of(const SceneModel& scene, const CostOptions& options, const CostRow& row);

} // namespace trocar::engine
