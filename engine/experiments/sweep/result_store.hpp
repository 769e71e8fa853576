// Results of a sweep on the disk, by chunk. While a chunk is worked on, every finished run is one line of a file of its worker; when
// the chunk is complete, its lines are packed into one file and the workers' files go. A line has a checksum: one that was cut off is
// no result. Any number of workers may write at once, on any machine: each has a file of its own, and readers take no locks.
#pragma once

#include "engine/experiments/sweep/sweep_plan.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

struct RunResult {
    std::uint64_t run = 0;
    std::string key;                 // of the planned run
    std::string status;              // "done", or "failed: ..."
    std::vector<std::string> values; // cells of the table, one for each collected name
    std::string figures;             // JSON of the figures' file; "null" where there is none
};

/// Names in a sweep's folder.
namespace sweep_name {
inline constexpr const char* kPlan = "plan.json";
inline constexpr const char* kResults = "results";
inline constexpr const char* kRuns = "runs";       // whole output folders, by key
inline constexpr const char* kScratch = "scratch"; // of runs that are going on
inline constexpr const char* kSlurm = "slurm";
inline constexpr const char* kLock = ".sweep.lock";
} // namespace sweep_name

[[nodiscard]] std::string result_line(const RunResult& result);
/// Nothing of a line that is damaged.
[[nodiscard]] std::optional<RunResult> parse_result_line(std::string_view line);

/// What a chunk has come to.
struct ChunkResults {
    std::map<std::uint64_t, RunResult> runs;
    std::vector<std::filesystem::path> parts; // workers' files
    bool is_packed = false;
    bool is_worked_on = false; // some worker on this machine, or one whose locks the file system shows
};

class ResultStore {
public:
    /// folder  of the sweep; plan outlives it
    ResultStore(std::filesystem::path folder, const SweepPlan& plan) : folder_(std::move(folder)), plan_(plan) {}

    /// Workers' files by chunk, of the chunks that have any file.
    using Parts = std::map<std::uint64_t, std::vector<std::filesystem::path>>;
    /// The folder is listed once: a chunk that is not among them has no results.
    [[nodiscard]] Parts find_begun() const;
    /// Results of another key than the plan's do not count.
    [[nodiscard]] ChunkResults read(std::uint64_t chunk) const { return read(chunk, find_begun()); }
    [[nodiscard]] ChunkResults read(std::uint64_t chunk, const Parts& begun) const;
    /// All lines of a complete chunk into one file.
    [[nodiscard]] Result<void> pack(std::uint64_t chunk, const ChunkResults& results) const;
    /// Packs the chunks that are complete in what killed workers left, and removes what they left of packed ones.
    [[nodiscard]] Result<void> pack_complete() const;
    /// Drops failed runs, so that they are missing. Not while a worker runs.
    [[nodiscard]] Result<std::size_t> drop_failed() const;

private:
    [[nodiscard]] std::filesystem::path packed_file(std::uint64_t chunk) const;
    std::filesystem::path folder_;
    const SweepPlan& plan_;
};

/// One worker's file of one chunk. It is locked while it is open.
class PartFile {
public:
    /// fails  CannotWrite
    [[nodiscard]] static Result<PartFile> create(const std::filesystem::path& folder, std::uint64_t chunk);
    PartFile(PartFile&& other) noexcept;
    PartFile& operator=(PartFile&&) = delete;
    ~PartFile();

    /// On the disk when it returns. fails  CannotWrite; the file is then as it was before
    [[nodiscard]] Result<void> add(const RunResult& result);
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

private:
    PartFile(std::filesystem::path path, int file) : path_(std::move(path)), file_(file) {}
    std::filesystem::path path_;
    int file_ = -1;
    std::size_t size_ = 0;
};

/// Does another process hold this file?
[[nodiscard]] bool is_locked(const std::filesystem::path& file);

} // namespace trocar::engine
