// Outputs of a run: an output folder with a row per step, a summary, pictures, a report, states for ParaView.
#pragma once

#include "engine/prepare/prepare_scene.hpp"
#include "engine/report/run_summary.hpp"
#include "engine/state/state.hpp"
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
    bool page = true; // report.html, whose plots take longer than a short run
    std::uint64_t steps = 0;             // that the run is going to take
    std::uint64_t checkpoint_every = 0;  // steps; 0: no checkpoints. The last step gets one too
    const State* resumed_from = nullptr; // where an earlier run stood; nullptr: the run begins at the beginning
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
    [[nodiscard]] Result<void> after_step(Simulator& simulator, const StepReport& report);

    /// Before finish(): the run went at a pace.
    void set_pace(const PaceSpec& pace, const PaceStats& stats);

    /// Before finish(): an output of the run that is written elsewhere (its name in the folder).
    void note_output(const std::string& name, const Result<void>& written);

    /// Writes what is only known at the end: steps.csv, pictures, report.html, and summary.json, which names what is missing. Whatever
    /// cannot be written, everything else is; see RunSummary::missing_outputs.
    /// interrupted  the run ended before its time, by request
    [[nodiscard]] RunSummary finish(Simulator& simulator, double wall_s, bool interrupted);

    /// Outputs given up on the way: no GL context, no gnuplot. One sentence each.
    [[nodiscard]] const std::vector<std::string>& notices() const noexcept;

private:
    struct Parts;
    explicit RunObserver(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> parts_;
};

} // namespace trocar::engine
