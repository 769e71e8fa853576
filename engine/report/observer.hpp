// Outputs of a run: an output folder with a row per step, a summary, pictures, a report, states for ParaView.
#pragma once

#include "engine/prepare/prepare_scene.hpp"
#include "engine/step/simulator.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

struct ObserveOptions {
    std::filesystem::path out; // folder; made if missing
    bool force = false;        // an existing folder that is not empty may be written into
    bool record = false;       // states for ParaView, every outputs.record_every steps (or so that 100 are kept)
    bool pictures = true;
    std::uint64_t steps = 0;             // that the run is going to take
    std::uint64_t checkpoint_every = 0;  // steps; 0: no checkpoints. The last step gets one too
    const State* resumed_from = nullptr; // where an earlier run stood; nullptr: the run begins at the beginning
};

/// Percentiles of one series, ms.
struct Percentiles {
    double p50 = 0.0, p95 = 0.0, p99 = 0.0, max = 0.0;
};

/// summary.json as numbers: what the last line on the terminal and the report's first lines are made of.
struct RunSummary {
    std::uint64_t steps = 0;
    double simulated_s = 0.0, wall_s = 0.0, realtime_factor = 0.0;
    std::optional<PaceSpec> pace; // none: as fast as it went
    PaceStats pace_stats;
    Percentiles step_ms, collision_ms;
    double budget_kept = 1.0;   // share of steps whose budgeted part ended within the budget, 0..1
    double realtime_kept = 1.0; // share of whole steps that took no longer than they simulate, 0..1
    double worst_overrun_ms = 0.0;
    std::uint64_t overruns = 0, realtime_overruns = 0; // steps that did not, of either kind
    std::uint64_t lumen_exits = 0, unresolved = 0, assumed = 0, contacts = 0, exact_steps = 0, held_back_steps = 0;
    std::uint64_t passed_places = 0, unproven_solids = 0; // sums of the steps'
    double target_distance_m = -1.0;
    std::string state_hash; // hex
    bool finite = true;
    std::string failure;
    std::vector<std::string> missing_outputs; // a sentence for each that could not be written; empty: all are there
};

/// Not for two threads. Everything that costs time here is outside the step and its budget.
class RunObserver {
public:
    /// Refuses a folder that is not empty (unless forced), that another run is using, or that cannot be written.
    [[nodiscard]] static Result<std::unique_ptr<RunObserver>> open(const Scene& scene, const PreparedScene& prepared,
                                                                   const ObserveOptions& options);
    ~RunObserver();
    RunObserver(const RunObserver&) = delete;
    RunObserver& operator=(const RunObserver&) = delete;

    /// After every step, also the one that stopped the run. An output that cannot be written loses neither the run nor the others:
    /// fails  CannotWrite, the first time that one is missing. The caller may go on, and call this and finish() as if it had not.
    [[nodiscard]] Result<void> after_step(const Simulator& simulator, const StepReport& report);

    /// Before finish(): the run went at a pace.
    void set_pace(const PaceSpec& pace, const PaceStats& stats);

    /// Before finish(): an output of the run that is written elsewhere (its name in the folder).
    void note_output(const std::string& name, const Result<void>& written);

    /// Writes what is only known at the end: steps.csv, pictures, report.html, and summary.json, which names what is missing. Whatever
    /// cannot be written, everything else is; see RunSummary::missing_outputs.
    /// interrupted  the run ended before its time, by request
    [[nodiscard]] RunSummary finish(const Simulator& simulator, double wall_s, bool interrupted);

    /// Outputs given up on the way: no GL context, no gnuplot. One sentence each.
    [[nodiscard]] const std::vector<std::string>& notices() const noexcept;

private:
    struct Parts;
    explicit RunObserver(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> parts_;
};

} // namespace trocar::engine
