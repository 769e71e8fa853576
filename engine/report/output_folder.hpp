// The folder a run writes into: made if missing, locked by one run at a time, never mixed with other files.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <span>

namespace trocar::engine {

/// Locks the folder while it lives. A run that was killed locks nothing: the system drops its lock with it.
class OutputFolder {
public:
    /// force    outputs of an earlier run are removed first, by their known names; other files are left alone
    /// keep     of the outputs of an earlier run this one stays: what a run goes on from; nullptr: none
    /// fails    CannotWrite: not empty (without force), in use by another run, a file in the way, read-only, disk full
    [[nodiscard]] static Result<OutputFolder> open(const std::filesystem::path& path, bool force, const char* keep = nullptr);

    /// Before long work whose result goes there: would open() take it now? Makes, removes and holds nothing.
    /// reads    files that the work reads: none may lie there under the name of an output, which is removed and written anew. One that is not
    ///          there is passed over
    /// keep     as of open(): may be read
    /// fails    as open(); BadUsage: such a file
    [[nodiscard]] static Result<void> check(const std::filesystem::path& path, bool force, std::span<const std::filesystem::path> reads,
                                            const char* keep = nullptr);

    OutputFolder(OutputFolder&& other) noexcept;
    OutputFolder& operator=(OutputFolder&&) = delete;
    ~OutputFolder();

    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

private:
    OutputFolder(std::filesystem::path path, int lock) : path_(std::move(path)), lock_(lock) {}
    std::filesystem::path path_;
    int lock_ = -1; // file descriptor; the lock file is removed with it
};

/// Names of a run's files in an output folder.
namespace output_name {
inline constexpr const char* kLock = ".trocar.lock";
inline constexpr const char* kSteps = "steps.csv";
inline constexpr const char* kPartialSteps = "steps.csv.partial"; // until the run ends; all that is left of a killed one
inline constexpr const char* kActions = "actions.csv"; // of an episode
inline constexpr const char* kManifest = "manifest.json"; // likewise, its record
inline constexpr const char* kManifestHash = "manifest.hash";
inline constexpr const char* kSummary = "summary.json";
inline constexpr const char* kReport = "report.html";
inline constexpr const char* kTrace = "trace.json";
inline constexpr const char* kCost = "cost.csv";
inline constexpr const char* kCostJson = "cost.json";
inline constexpr const char* kParts = "parts";               // folder, while costs are measured
inline constexpr const char* kPath = "path.csv";             // of a plan
inline constexpr const char* kCentreline = "centreline.csv"; // likewise
inline constexpr const char* kPlan = "plan.json";
inline constexpr const char* kPrepare = "prepare.json";
inline constexpr const char* kSpheres = "spheres.sph";
inline constexpr const char* kCheckpoint = "checkpoint.bin"; // the newest one
inline constexpr const char* kRecord = "record";
inline constexpr const char* kFluoro = "fluoro"; // X-ray frames
inline constexpr const char* kLastGoodState = "last_good_state";
} // namespace output_name

} // namespace trocar::engine
