#include "engine/observe/step_table.hpp"

#include "engine/observe/output_folder.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <concepts>
#include <cstring>
#include <iterator>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace seldinger::engine {

namespace {

/// At most this much of the run is lost when it is killed.
constexpr double kFlushMs = 250.0;
constexpr std::size_t kFlushBytes = std::size_t{64} << 10;

struct Row {
    const StepReport& r;
    double budget_ms;
};

void append(std::string& text, double value) {
    char digits[32];
    const std::to_chars_result end = std::to_chars(std::begin(digits), std::end(digits), value); // shortest that reads back the same
    text.append(digits, end.ptr);
}

template <std::integral Integer>
void append(std::string& text, Integer value) {
    fmt::format_to(std::back_inserter(text), "{}", static_cast<std::int64_t>(value));
}

struct Column {
    const char* name;
    void (*append_value)(std::string&, const Row&);
};

#define SELDINGER_COLUMN(name, value)                                                                                                      \
    {                                                                                                                                      \
        name, [](std::string& text, const Row& row) { append(text, value); }                                                               \
    }
constexpr Column kColumns[] = {
    // the contract's, in its order
    SELDINGER_COLUMN("step", row.r.step),
    SELDINGER_COLUMN("time_s", row.r.time_s),
    SELDINGER_COLUMN("substeps", row.r.substeps),
    SELDINGER_COLUMN("fem_ms", row.r.ms.fem),
    SELDINGER_COLUMN("steer_ms", row.r.ms.steer),
    SELDINGER_COLUMN("descend_ms", row.r.ms.descend),
    SELDINGER_COLUMN("exact_ms", row.r.ms.exact),
    SELDINGER_COLUMN("respond_ms", row.r.ms.respond),
    SELDINGER_COLUMN("total_ms", row.r.ms.total),
    SELDINGER_COLUMN("budget_ms", row.budget_ms),
    SELDINGER_COLUMN("pairs_tested", row.r.pairs_tested),
    SELDINGER_COLUMN("pairs_open", row.r.pairs_open),
    SELDINGER_COLUMN("leaf_contacts", row.r.leaf_contacts),
    SELDINGER_COLUMN("level_reached", row.r.level_reached),
    SELDINGER_COLUMN("exact_ran", row.r.exact_ran),
    SELDINGER_COLUMN("exact_contacts", row.r.exact_contacts),
    SELDINGER_COLUMN("unresolved", row.r.unresolved),
    SELDINGER_COLUMN("min_volume_ratio", row.r.min_volume_ratio),
    SELDINGER_COLUMN("inverted_tets", row.r.inverted_tets),
    SELDINGER_COLUMN("kinetic_j", row.r.kinetic_j),
    SELDINGER_COLUMN("elastic_j", row.r.elastic_j),
    SELDINGER_COLUMN("tip_x", row.r.tip.x()),
    SELDINGER_COLUMN("tip_y", row.r.tip.y()),
    SELDINGER_COLUMN("tip_z", row.r.tip.z()),
    SELDINGER_COLUMN("insertion_m", row.r.insertion_m),
    SELDINGER_COLUMN("rotation_rad", row.r.rotation_rad),
    // ours
    SELDINGER_COLUMN("charged_ms", row.r.ms.budget), // what counted against the budget
    SELDINGER_COLUMN("budget_kept", row.r.budget_kept),
    SELDINGER_COLUMN("work_units", row.r.work_units),
    SELDINGER_COLUMN("assumed", row.r.assumed),
    SELDINGER_COLUMN("unproven_links", row.r.unproven_links),
    SELDINGER_COLUMN("exact_abandoned", row.r.exact_abandoned),
    SELDINGER_COLUMN("candidates", row.r.candidates),
    SELDINGER_COLUMN("corrections", row.r.corrections),
    SELDINGER_COLUMN("safe_fraction", row.r.safe_fraction),
    SELDINGER_COLUMN("exact_insisted", row.r.exact_insisted),
    SELDINGER_COLUMN("hand_limited", row.r.hand_limited),
    SELDINGER_COLUMN("hand_stops", row.r.hand_stops),
    SELDINGER_COLUMN("clamped_forces", row.r.clamped_forces),
    SELDINGER_COLUMN("lumen_exits", row.r.lumen_exits),
    SELDINGER_COLUMN("contact_force_n", row.r.contact_force_n),
    SELDINGER_COLUMN("max_contact_force_n", row.r.max_contact_force_n),
    SELDINGER_COLUMN("target_distance_m", row.r.target_distance_m),
    SELDINGER_COLUMN("stable_step_s", row.r.stable_step_s),
    SELDINGER_COLUMN("script_ms", row.r.ms.script),
    SELDINGER_COLUMN("observe_ms", row.r.ms.observe),
    SELDINGER_COLUMN("charged_cpu_ms", row.r.ms.budget_cpu), // charged_ms in this thread's own time
    SELDINGER_COLUMN("dropped", row.r.dropped),
    SELDINGER_COLUMN("friction_force_n", row.r.friction_force_n),
    SELDINGER_COLUMN("solid_touches", row.r.solid_touches),
    SELDINGER_COLUMN("deepest_touch_m", row.r.deepest_touch_m),
    SELDINGER_COLUMN("held_pairs", row.r.held_pairs),
    SELDINGER_COLUMN("residual_n", row.r.residual_n),
    SELDINGER_COLUMN("probe_tests", row.r.probe_tests),
    SELDINGER_COLUMN("culled_by", row.r.culled_by), // 0 nobody, 1 the CPU twin, 2 OpenGL
    SELDINGER_COLUMN("cull_items", row.r.cull_items),
    SELDINGER_COLUMN("cull_apart", row.r.cull_apart),
    SELDINGER_COLUMN("cull_late", row.r.cull_late),
    SELDINGER_COLUMN("cull_left_out", row.r.cull_left_out),
    SELDINGER_COLUMN("passed_places", row.r.passed_places),
    SELDINGER_COLUMN("unproven_solids", row.r.unproven_solids),
};
#undef SELDINGER_COLUMN

Error cannot_write(const std::filesystem::path& path, int reason) {
    return {.code = ErrorCode::CannotWrite, .message = fmt::format("cannot be written: {}", std::strerror(reason)), .file = path.string()};
}

} // namespace

std::string step_table_header() {
    std::string text;
    for (const Column& column : kColumns) text.append(text.empty() ? "" : ",").append(column.name);
    return text;
}

void append_step_row(const StepReport& report, double budget_ms, std::string& text) {
    const Row row{report, budget_ms};
    for (const Column& column : kColumns) {
        column.append_value(text, row);
        text += ',';
    }
    text.back() = '\n';
}

Result<StepTable> StepTable::create(const std::filesystem::path& folder, double budget_ms) {
    const std::filesystem::path path = folder / output_name::kPartialSteps;
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file < 0) return cannot_write(path, errno);
    StepTable table(folder, file, budget_ms);
    table.pending_ = step_table_header() + "\n";
    if (Result<void> flushed = table.flush(); !flushed) return flushed.error();
    return table;
}

StepTable::StepTable(std::filesystem::path folder, int file, double budget_ms)
    : folder_(std::move(folder)), file_(file), budget_ms_(budget_ms) {}

StepTable::StepTable(StepTable&& other) noexcept
    : folder_(std::move(other.folder_)), file_(std::exchange(other.file_, -1)), budget_ms_(other.budget_ms_),
      pending_(std::move(other.pending_)), since_flush_(other.since_flush_) {}

StepTable::~StepTable() {
    if (file_ < 0) return;
    (void)flush(); // a run that failed elsewhere: what can be kept is kept
    ::close(file_);
}

Result<void> StepTable::add(const StepReport& report) {
    append_step_row(report, budget_ms_, pending_);
    if (pending_.size() < kFlushBytes && since_flush_.elapsed_ms() < kFlushMs) return {};
    return flush();
}

Result<void> StepTable::flush() {
    std::size_t done = 0;
    while (done < pending_.size()) {
        const ssize_t written = ::write(file_, pending_.data() + done, pending_.size() - done);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) {
            const int reason = errno;
            pending_.erase(0, done);
            return cannot_write(folder_ / output_name::kPartialSteps, reason);
        }
        done += static_cast<std::size_t>(written);
    }
    pending_.clear();
    (void)since_flush_.lap_ms();
    return {};
}

Result<void> StepTable::finish() {
    if (Result<void> flushed = flush(); !flushed) return flushed;
    const std::filesystem::path partial = folder_ / output_name::kPartialSteps;
    int reason = ::fsync(file_) != 0 && errno != EINVAL ? errno : 0;
    if (::close(std::exchange(file_, -1)) != 0 && reason == 0) reason = errno;
    if (reason == 0 && ::rename(partial.c_str(), (folder_ / output_name::kSteps).c_str()) != 0) reason = errno;
    if (reason != 0) return cannot_write(partial, reason);
    return {};
}

} // namespace seldinger::engine
