#include "engine/report/step_table.hpp"

#include "engine/report/output_folder.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <concepts>
#include <cstring>
#include <iterator>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace trocar::engine {

namespace {

/// At most this much of the run is lost when it is killed.
constexpr double kFlushMs = 250.0;
constexpr std::size_t kFlushBytes = std::size_t{64} << 10;
constexpr std::size_t kMostPending = std::size_t{64} << 20; // bytes buffered while the disk is full; beyond it rows are lost

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

const AccountEntry& account_of(const StepReport& report, AccountPart part) { return report.account[static_cast<std::size_t>(part)]; }

struct StepColumn {
    const char* name;
    void (*append_value)(std::string&, const Row&);
};

#define TROCAR_COLUMN(name, value)                                                                                                         \
    {                                                                                                                                      \
        name, [](std::string& text, const Row& row) { append(text, value); }                                                               \
    }
constexpr StepColumn kColumns[] = {
    // the contract's, in its order
    TROCAR_COLUMN("step", row.r.step),
    TROCAR_COLUMN("time_s", row.r.time_s),
    TROCAR_COLUMN("substeps", row.r.substeps),
    TROCAR_COLUMN("fem_ms", row.r.ms.fem),
    TROCAR_COLUMN("steer_ms", row.r.ms.steer),
    TROCAR_COLUMN("descend_ms", row.r.ms.descend),
    TROCAR_COLUMN("exact_ms", row.r.ms.exact),
    TROCAR_COLUMN("respond_ms", row.r.ms.respond),
    TROCAR_COLUMN("total_ms", row.r.ms.total),
    TROCAR_COLUMN("budget_ms", row.budget_ms),
    TROCAR_COLUMN("pairs_tested", row.r.pairs_tested),
    TROCAR_COLUMN("pairs_open", row.r.pairs_open),
    TROCAR_COLUMN("leaf_contacts", row.r.leaf_contacts),
    TROCAR_COLUMN("level_reached", row.r.level_reached),
    TROCAR_COLUMN("exact_ran", row.r.exact_ran),
    TROCAR_COLUMN("exact_contacts", row.r.exact_contacts),
    TROCAR_COLUMN("unresolved", row.r.unresolved),
    TROCAR_COLUMN("min_volume_ratio", row.r.min_volume_ratio),
    TROCAR_COLUMN("inverted_tets", row.r.inverted_tets),
    TROCAR_COLUMN("kinetic_j", row.r.kinetic_j),
    TROCAR_COLUMN("elastic_j", row.r.elastic_j),
    TROCAR_COLUMN("tip_x", row.r.tip.x()),
    TROCAR_COLUMN("tip_y", row.r.tip.y()),
    TROCAR_COLUMN("tip_z", row.r.tip.z()),
    TROCAR_COLUMN("insertion_m", row.r.insertion_m),
    TROCAR_COLUMN("rotation_rad", row.r.rotation_rad),
    // ours
    TROCAR_COLUMN("charged_ms", row.r.ms.budget), // what counted against the budget
    TROCAR_COLUMN("budget_kept", row.r.budget_kept),
    TROCAR_COLUMN("work_units", row.r.work_units),
    TROCAR_COLUMN("assumed", row.r.assumed),
    TROCAR_COLUMN("unproven_links", row.r.unproven_links),
    TROCAR_COLUMN("exact_abandoned", row.r.exact_abandoned),
    TROCAR_COLUMN("candidates", row.r.candidates),
    TROCAR_COLUMN("corrections", row.r.corrections),
    TROCAR_COLUMN("safe_fraction", row.r.safe_fraction),
    TROCAR_COLUMN("exact_insisted", row.r.exact_forced),
    TROCAR_COLUMN("hand_limited", row.r.drive_limited),
    TROCAR_COLUMN("hand_stops", row.r.drive_stops),
    TROCAR_COLUMN("clamped_forces", row.r.clamped_forces),
    TROCAR_COLUMN("lumen_exits", row.r.lumen_exits),
    TROCAR_COLUMN("contact_force_n", row.r.contact_force_n),
    TROCAR_COLUMN("max_contact_force_n", row.r.max_contact_force_n),
    TROCAR_COLUMN("target_distance_m", row.r.target_distance_m),
    TROCAR_COLUMN("stable_step_s", row.r.stable_step_s),
    TROCAR_COLUMN("script_ms", row.r.ms.script),
    TROCAR_COLUMN("observe_ms", row.r.ms.observe),
    TROCAR_COLUMN("charged_cpu_ms", row.r.ms.budget_cpu), // charged_ms in this thread's own time
    TROCAR_COLUMN("dropped", row.r.dropped),
    TROCAR_COLUMN("friction_force_n", row.r.friction_force_n),
    TROCAR_COLUMN("solid_touches", row.r.solid_touches),
    TROCAR_COLUMN("deepest_touch_m", row.r.deepest_touch_m),
    TROCAR_COLUMN("held_pairs", row.r.held_pairs),
    TROCAR_COLUMN("residual_n", row.r.residual_n),
    TROCAR_COLUMN("probe_tests", row.r.probe_tests),
    TROCAR_COLUMN("culled_by", row.r.culled_by), // 0 none, 1 the CPU reference, 2 OpenGL
    TROCAR_COLUMN("cull_items", row.r.cull_items),
    TROCAR_COLUMN("cull_apart", row.r.cull_apart),
    TROCAR_COLUMN("cull_late", row.r.cull_late),
    TROCAR_COLUMN("cull_left_out", row.r.cull_left_out),
    TROCAR_COLUMN("passed_places", row.r.passed_places),
    TROCAR_COLUMN("unproven_solids", row.r.unproven_solids),
    TROCAR_COLUMN("softened", row.r.softened),
    TROCAR_COLUMN("solid_force_n", row.r.solid_force_n),
    TROCAR_COLUMN("max_solid_force_n", row.r.max_solid_force_n),
    TROCAR_COLUMN("contact_iterations", row.r.contact_iterations),
    TROCAR_COLUMN("contact_unconverged", row.r.contact_unconverged),
    TROCAR_COLUMN("contact_residual_n", row.r.contact_residual_n),
    TROCAR_COLUMN("handle_force_n", row.r.handle_force_n),
    TROCAR_COLUMN("handle_torque_nm", row.r.handle_torque_nm),
    TROCAR_COLUMN("rod_balance_n", row.r.balance_n),
    TROCAR_COLUMN("rod_unsettled", row.r.unsettled_rods),
    TROCAR_COLUMN("rod_slowed", row.r.slowed_rods),
    TROCAR_COLUMN("pressing_contacts", row.r.pressing_contacts),
    TROCAR_COLUMN("rod_iterations", row.r.rod_iterations),
    TROCAR_COLUMN("self_contacts", row.r.self_contacts),
    TROCAR_COLUMN("self_force_n", row.r.self_force_n),
    TROCAR_COLUMN("self_held", row.r.self_held),
    TROCAR_COLUMN("instrument_contacts", row.r.instrument_contacts),
    TROCAR_COLUMN("instrument_force_n", row.r.instrument_force_n),
    TROCAR_COLUMN("instrument_held", row.r.instrument_held),
    TROCAR_COLUMN("packing_density", row.r.packing_density), // -1: the scene names no ball
    // the account: left of the budget when a part began (-1: no limit of time), taken by it, and work units taken
    TROCAR_COLUMN("solve_granted_ms", account_of(row.r, AccountPart::Solve).granted_ms),
    TROCAR_COLUMN("solve_used_ms", account_of(row.r, AccountPart::Solve).used_ms),
    TROCAR_COLUMN("solve_units", account_of(row.r, AccountPart::Solve).units),
    TROCAR_COLUMN("descent_granted_ms", account_of(row.r, AccountPart::Descent).granted_ms),
    TROCAR_COLUMN("descent_used_ms", account_of(row.r, AccountPart::Descent).used_ms),
    TROCAR_COLUMN("descent_units", account_of(row.r, AccountPart::Descent).units),
    TROCAR_COLUMN("exact_granted_ms", account_of(row.r, AccountPart::Exact).granted_ms),
    TROCAR_COLUMN("exact_used_ms", account_of(row.r, AccountPart::Exact).used_ms),
    TROCAR_COLUMN("exact_units", account_of(row.r, AccountPart::Exact).units),
    TROCAR_COLUMN("walls_granted_ms", account_of(row.r, AccountPart::Walls).granted_ms),
    TROCAR_COLUMN("walls_used_ms", account_of(row.r, AccountPart::Walls).used_ms),
    TROCAR_COLUMN("walls_units", account_of(row.r, AccountPart::Walls).units),
    TROCAR_COLUMN("surfaces_granted_ms", account_of(row.r, AccountPart::Surfaces).granted_ms),
    TROCAR_COLUMN("surfaces_used_ms", account_of(row.r, AccountPart::Surfaces).used_ms),
    TROCAR_COLUMN("surfaces_units", account_of(row.r, AccountPart::Surfaces).units),
    TROCAR_COLUMN("below_floor", row.r.below_floor),
    TROCAR_COLUMN("left_pairs", row.r.left_pairs),
    TROCAR_COLUMN("carried_places", row.r.carried_places),
};
#undef TROCAR_COLUMN

Error cannot_write(const std::filesystem::path& path, int reason) {
    return {.code = ErrorCode::CannotWrite, .message = fmt::format("cannot be written: {}", std::strerror(reason)), .file = path.string()};
}

} // namespace

std::string step_table_header() {
    std::string text;
    for (const StepColumn& column : kColumns) text.append(text.empty() ? "" : ",").append(column.name);
    return text;
}

void append_step_row(const StepReport& report, double budget_ms, std::string& text) {
    const Row row{report, budget_ms};
    for (const StepColumn& column : kColumns) {
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
    : folder_(std::move(other.folder_)), file_(std::exchange(other.file_, -1)), failed_(other.failed_), lost_(other.lost_),
      budget_ms_(other.budget_ms_), pending_(std::move(other.pending_)), since_flush_(other.since_flush_) {}

StepTable::~StepTable() {
    if (file_ < 0) return;
    if (!lost_) (void)flush(); // a run that failed elsewhere: what can be kept is kept
    ::close(file_);
}

Result<void> StepTable::add(const StepReport& report) {
    if (!lost_) append_step_row(report, budget_ms_, pending_);
    const bool due = since_flush_.elapsed_ms() >= kFlushMs || (failed_ == 0 && pending_.size() >= kFlushBytes);
    if (due && !lost_) return flush();
    return failed_ == 0 ? Result<void>() : cannot_write(folder_ / output_name::kPartialSteps, failed_);
}

Result<void> StepTable::flush() {
    std::size_t done = 0;
    while (done < pending_.size()) {
        const ssize_t written = ::write(file_, pending_.data() + done, pending_.size() - done);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) {
            const int reason = errno;
            pending_.erase(0, done);
            (void)since_flush_.lap_ms(); // the next attempt is as far away as after a success
            failed_ = reason;
            lost_ = pending_.size() > kMostPending;
            if (lost_) pending_ = {};
            return cannot_write(folder_ / output_name::kPartialSteps, reason);
        }
        done += static_cast<std::size_t>(written);
    }
    pending_.clear();
    failed_ = 0;
    (void)since_flush_.lap_ms();
    return {};
}

Result<void> StepTable::finish() {
    if (lost_) return cannot_write(folder_ / output_name::kPartialSteps, failed_);
    if (Result<void> flushed = flush(); !flushed) return flushed;
    const std::filesystem::path partial = folder_ / output_name::kPartialSteps;
    int reason = ::fsync(file_) != 0 && errno != EINVAL ? errno : 0;
    if (::close(std::exchange(file_, -1)) != 0 && reason == 0) reason = errno;
    if (reason == 0 && ::rename(partial.c_str(), (folder_ / output_name::kSteps).c_str()) != 0) reason = errno;
    if (reason != 0) return cannot_write(partial, reason);
    return {};
}

} // namespace trocar::engine
