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
    OutputKey key;
    void (*append_value)(std::string&, const Row&);
};

#define TROCAR_COLUMN(name, unit, meaning, value)                                                                                          \
    {                                                                                                                                      \
        {name, unit, meaning}, [](std::string& text, const Row& row) { append(text, value); }                                              \
    }
constexpr StepColumn kColumns[] = {
    // the columns that scripts rely on, in their order
    TROCAR_COLUMN("step", "", "Number of the step; the first one is 1.", row.r.step),
    TROCAR_COLUMN("time_s", "s", "Simulated time at the end of the step.", row.r.time_s),
    TROCAR_COLUMN("substeps", "", "Sub-steps of the tissue's integration; the most of any body.", row.r.substeps),
    TROCAR_COLUMN("fem_ms", "ms", "Wall time of the tissue's integration and of the instruments' free motion.", row.r.ms.fem),
    TROCAR_COLUMN("steer_ms", "ms", "Wall time of embedded surfaces and of sphere trees that are brought up to date.", row.r.ms.steer),
    TROCAR_COLUMN("descend_ms", "ms", "Wall time of the traversal of sphere trees (coarse contact).", row.r.ms.descend),
    TROCAR_COLUMN("exact_ms", "ms", "Wall time of continuous tests (exact contact).", row.r.ms.exact),
    TROCAR_COLUMN("respond_ms", "ms", "Wall time of the contact response, without the exact tests that it repeats.", row.r.ms.respond),
    TROCAR_COLUMN("total_ms", "ms", "Wall time of the whole step, observation excluded.", row.r.ms.total),
    TROCAR_COLUMN("budget_ms", "ms", "Limit of the step's budget; `inf` where the budget is not a time.", row.budget_ms),
    TROCAR_COLUMN("pairs_tested", "", "Pairs of spheres that the traversal tested.", row.r.pairs_tested),
    TROCAR_COLUMN("pairs_open", "", "Pairs of spheres that were still open when the budget ended the traversal.", row.r.pairs_open),
    TROCAR_COLUMN("leaf_contacts", "", "Pairs of leaf spheres in contact.", row.r.leaf_contacts),
    TROCAR_COLUMN("level_reached", "", "Coarsest level of the sphere trees still open when the traversal ended; the leaf depth where none is.", row.r.level_reached),
    TROCAR_COLUMN("exact_ran", "", "1: the exact stage gave this step's answer, for every instrument.", row.r.exact_ran),
    TROCAR_COLUMN("exact_contacts", "", "Contacts that continuous tests found, those that a correction removed included.", row.r.exact_contacts),
    TROCAR_COLUMN("unresolved", "", "Continuous tests that ended without a verdict; the motion is then scaled to the proven safe fraction.", row.r.unresolved),
    TROCAR_COLUMN("min_volume_ratio", "[-]", "Smallest volume of a tetrahedron over its volume at rest; 0 or less: inverted.", row.r.min_volume_ratio),
    TROCAR_COLUMN("inverted_tets", "", "Tetrahedra whose volume is 0 or less.", row.r.inverted_tets),
    TROCAR_COLUMN("kinetic_j", "J", "Kinetic energy of everything that moves.", row.r.kinetic_j),
    TROCAR_COLUMN("elastic_j", "J", "Elastic energy of tissue and instruments.", row.r.elastic_j),
    TROCAR_COLUMN("tip_x", "m", "Tip of the first instrument, x.", row.r.tip.x()),
    TROCAR_COLUMN("tip_y", "m", "Tip of the first instrument, y.", row.r.tip.y()),
    TROCAR_COLUMN("tip_z", "m", "Tip of the first instrument, z.", row.r.tip.z()),
    TROCAR_COLUMN("insertion_m", "m", "Length of the first instrument beyond its port.", row.r.insertion_m),
    TROCAR_COLUMN("rotation_rad", "rad", "Rotation of the first instrument's handle.", row.r.rotation_rad),
    // more; they keep their names
    TROCAR_COLUMN("charged_ms", "ms", "Wall time that counted against the budget.", row.r.ms.budget),
    TROCAR_COLUMN("budget_kept", "", "1: charged_ms is within budget_ms, or the budget is not a time.", row.r.budget_kept),
    TROCAR_COLUMN("work_units", "", "Units of work: sphere-pair tests, and what else a budget of work counts (docs/budget.md).", row.r.work_units),
    TROCAR_COLUMN("assumed", "", "Sphere pairs that the budget left untested and that count as contacts.", row.r.assumed),
    TROCAR_COLUMN("unproven_links", "", "Links of instruments that nothing proved free of the wall in this step.", row.r.unproven_links),
    TROCAR_COLUMN("exact_abandoned", "", "1: the exact stage was started, and ended by the budget; its answer was not used.", row.r.exact_abandoned),
    TROCAR_COLUMN("candidates", "", "Pairs of features that reached the continuous tests.", row.r.candidates),
    TROCAR_COLUMN("corrections", "", "Times that an instrument was solved again because a continuous test still hit.", row.r.corrections),
    TROCAR_COLUMN("safe_fraction", "[-]", "Share of the step's motion that was taken; less than 1: scaled to the safe fraction.", row.r.safe_fraction),
    TROCAR_COLUMN("exact_insisted", "", "1: the exact stage did not fit the budget and ran all the same, to keep an instrument in its lumen.", row.r.exact_forced),
    TROCAR_COLUMN("hand_limited", "", "Instruments whose drive command was cut to the drive's limit.", row.r.drive_limited),
    TROCAR_COLUMN("hand_stops", "", "Instruments whose drive was stopped because its push met the wall.", row.r.drive_stops),
    TROCAR_COLUMN("clamped_forces", "", "Always 0: forces are not cut.", row.r.clamped_forces),
    TROCAR_COLUMN("lumen_exits", "", "Instrument vertices outside the lumen at the end of the step, by an independent test.", row.r.lumen_exits),
    TROCAR_COLUMN("contact_force_n", "N", "Sum of the normal forces of instruments on walls.", row.r.contact_force_n),
    TROCAR_COLUMN("max_contact_force_n", "N", "Largest normal force of an instrument on a wall.", row.r.max_contact_force_n),
    TROCAR_COLUMN("target_distance_m", "m", "Straight distance from the tip to the followed target; -1: no target is followed.", row.r.target_distance_m),
    TROCAR_COLUMN("stable_step_s", "s", "Smallest stable sub-step of the deformable bodies; of those that are advanced implicitly, the shortest one taken; 0: there are none.", row.r.stable_step_s),
    TROCAR_COLUMN("script_ms", "ms", "Wall time of drive commands and the scene's script.", row.r.ms.script),
    TROCAR_COLUMN("observe_ms", "ms", "Wall time of independent checks; not part of the step.", row.r.ms.observe),
    TROCAR_COLUMN("charged_cpu_ms", "ms", "charged_ms in this thread's own processor time.", row.r.ms.budget_cpu),
    TROCAR_COLUMN("dropped", "", "Effects that the step left out to fit its budget, a bit each (docs/budget.md).", row.r.dropped),
    TROCAR_COLUMN("friction_force_n", "N", "Sum of the friction forces of instruments on walls.", row.r.friction_force_n),
    TROCAR_COLUMN("solid_touches", "", "Places where the surfaces of solid bodies touch.", row.r.solid_touches),
    TROCAR_COLUMN("deepest_touch_m", "m", "Penetration depth at the deepest of them.", row.r.deepest_touch_m),
    TROCAR_COLUMN("held_pairs", "", "Sphere pairs of solid bodies that push or hold in place of a surface's depth.", row.r.held_pairs),
    TROCAR_COLUMN("residual_n", "N", "Always 0: both bodies feel the same impulses.", row.r.residual_n),
    TROCAR_COLUMN("probe_tests", "", "Closest-point queries in place of sphere pairs that the budget left open.", row.r.probe_tests),
    TROCAR_COLUMN("culled_by", "", "Which candidate filter ran: 0 none, 1 the CPU reference, 2 OpenGL.", row.r.culled_by),
    TROCAR_COLUMN("cull_items", "", "Candidates that the filter tested.", row.r.cull_items),
    TROCAR_COLUMN("cull_apart", "", "Of them proven apart.", row.r.cull_apart),
    TROCAR_COLUMN("cull_late", "", "Filter passes whose answer came after the tests and was not used.", row.r.cull_late),
    TROCAR_COLUMN("cull_left_out", "", "Filter passes that the budget had no time for, or that found the device busy.", row.r.cull_left_out),
    TROCAR_COLUMN("passed_places", "", "Vertices beyond the middle of a solid body, or through it; pushed back to the side they came from.", row.r.passed_places),
    TROCAR_COLUMN("unproven_solids", "", "Pairs of solid bodies of which one may have passed the other unseen in this step.", row.r.unproven_solids),
    TROCAR_COLUMN("softened", "", "Always 0: solids are not pushed by springs.", row.r.softened),
    TROCAR_COLUMN("solid_force_n", "N", "Sum of the normal forces where solid bodies touch, mean over the step.", row.r.solid_force_n),
    TROCAR_COLUMN("max_solid_force_n", "N", "Largest of them.", row.r.max_solid_force_n),
    TROCAR_COLUMN("raised_bodies", "", "Bodies that took more sub-steps than `time.substeps` asks for, since stability does.", row.r.raised_bodies),
    TROCAR_COLUMN("explicit_bodies", "", "Bodies whose implicit step did not converge; explicit sub-steps took its place.", row.r.explicit_bodies),
    TROCAR_COLUMN("contact_iterations", "", "Iterations of the solver of solid contact, all sub-steps together.", row.r.contact_iterations),
    TROCAR_COLUMN("contact_unconverged", "", "Sub-steps whose solve ended at its bound of iterations.", row.r.contact_unconverged),
    TROCAR_COLUMN("contact_residual_n", "N", "Largest force that a solve still wanted to change when it ended.", row.r.contact_residual_n),
    TROCAR_COLUMN("handle_force_n", "N", "Force of the drive on the first instrument, along the port's axis; positive: it pushes.", row.r.handle_force_n),
    TROCAR_COLUMN("handle_torque_nm", "N m", "Torque of the drive on the first instrument about the port's axis.", row.r.handle_torque_nm),
    TROCAR_COLUMN("rod_balance_n", "N", "Largest sum of handle, contact, load and inertia forces over an instrument; 0 is a perfect balance.", row.r.balance_n),
    TROCAR_COLUMN("rod_unsettled", "", "Stages of instruments whose contact forces had not settled when the iteration ended.", row.r.unsettled_rods),
    TROCAR_COLUMN("rod_slowed", "", "Instruments that were slowed because they would have moved farther than the wall near them was known.", row.r.slowed_rods),
    TROCAR_COLUMN("rod_stretch", "[-]", "Largest share by which a segment of an instrument is longer or shorter than at rest.", row.r.rod_stretch),
    TROCAR_COLUMN("pressing_contacts", "", "Places where an instrument presses on its wall.", row.r.pressing_contacts),
    TROCAR_COLUMN("rod_iterations", "", "Newton iterations of all instruments in the step.", row.r.rod_iterations),
    TROCAR_COLUMN("self_contacts", "", "Places where instruments press on themselves.", row.r.self_contacts),
    TROCAR_COLUMN("self_force_n", "N", "Sum of the normal forces of instruments on themselves.", row.r.self_force_n),
    TROCAR_COLUMN("self_held", "", "Instruments that took only the part of their motion that was proven not to pass through themselves.", row.r.self_held),
    TROCAR_COLUMN("instrument_contacts", "", "Places where instruments press on one another.", row.r.instrument_contacts),
    TROCAR_COLUMN("instrument_force_n", "N", "Sum of the normal forces between instruments.", row.r.instrument_force_n),
    TROCAR_COLUMN("instrument_held", "", "Instruments that took only the part of their motion that was proven not to pass through one another.", row.r.instrument_held),
    TROCAR_COLUMN("bore_excess_m", "m", "Farthest that an instrument with play is beyond the bore that it runs in.", row.r.bore_excess_m),
    TROCAR_COLUMN("beyond_bores", "", "Places of instruments with play that are beyond their bore by more than a tenth of the play.", row.r.beyond_bores),
    TROCAR_COLUMN("packing_density", "[-]", "Share of the scene's ball that instruments fill; -1: the scene names none.", row.r.packing_density),
    // the account: left of the budget when a part began (-1: no limit of time), taken by it, and work units taken
    TROCAR_COLUMN("solve_granted_ms", "ms", "Left of the budget when the solve of solid contact began; -1: the budget is not a time.", account_of(row.r, AccountPart::Solve).granted_ms),
    TROCAR_COLUMN("solve_used_ms", "ms", "Taken by the solve of solid contact.", account_of(row.r, AccountPart::Solve).used_ms),
    TROCAR_COLUMN("solve_units", "", "Units of work taken by the solve of solid contact.", account_of(row.r, AccountPart::Solve).units),
    TROCAR_COLUMN("descent_granted_ms", "ms", "Left of the budget when the traversal began; -1: the budget is not a time.", account_of(row.r, AccountPart::Descent).granted_ms),
    TROCAR_COLUMN("descent_used_ms", "ms", "Taken by the traversal.", account_of(row.r, AccountPart::Descent).used_ms),
    TROCAR_COLUMN("descent_units", "", "Units of work taken by the traversal.", account_of(row.r, AccountPart::Descent).units),
    TROCAR_COLUMN("exact_granted_ms", "ms", "Left of the budget when the exact stage began; -1: the budget is not a time.", account_of(row.r, AccountPart::Exact).granted_ms),
    TROCAR_COLUMN("exact_used_ms", "ms", "Taken by the exact stage.", account_of(row.r, AccountPart::Exact).used_ms),
    TROCAR_COLUMN("exact_units", "", "Units of work taken by the exact stage.", account_of(row.r, AccountPart::Exact).units),
    TROCAR_COLUMN("walls_granted_ms", "ms", "Left of the budget when the walls' planes began; -1: the budget is not a time.", account_of(row.r, AccountPart::Walls).granted_ms),
    TROCAR_COLUMN("walls_used_ms", "ms", "Taken by the walls' planes.", account_of(row.r, AccountPart::Walls).used_ms),
    TROCAR_COLUMN("walls_units", "", "Units of work taken by the walls' planes.", account_of(row.r, AccountPart::Walls).units),
    TROCAR_COLUMN("surfaces_granted_ms", "ms", "Left of the budget when the surfaces of solids began; -1: the budget is not a time.", account_of(row.r, AccountPart::Surfaces).granted_ms),
    TROCAR_COLUMN("surfaces_used_ms", "ms", "Taken by the surfaces of solids.", account_of(row.r, AccountPart::Surfaces).used_ms),
    TROCAR_COLUMN("surfaces_units", "", "Units of work taken by the surfaces of solids.", account_of(row.r, AccountPart::Surfaces).units),
    TROCAR_COLUMN("below_floor", "", "1: the budget was overrun although everything that may be left out was left out.", row.r.below_floor),
    TROCAR_COLUMN("left_pairs", "", "Pairs of solids, and of their leaves, that the budget left to their spheres.", row.r.left_pairs),
    TROCAR_COLUMN("carried_places", "", "Places that pressed there in the step before and are kept as they were, of solids, or that keep the planes of an earlier step, of instruments.", row.r.carried_places),
    TROCAR_COLUMN("exchange_gap_n", "N", "What instruments push their walls with at the step's end less what the tissue felt of it then, sum over instruments; 0: both agree.", row.r.exchange_gap_n),
    TROCAR_COLUMN("carried_instruments", "", "Instruments that ended at their predicted positions: no time to find the walls' planes at all places and to solve between them.", row.r.carried_instruments),
};
#undef TROCAR_COLUMN

Error cannot_write(const std::filesystem::path& path, int reason) {
    return {.code = ErrorCode::CannotWrite, .message = fmt::format("cannot be written: {}", std::strerror(reason)), .file = path.string()};
}

} // namespace

std::vector<OutputKey> step_table_columns() {
    std::vector<OutputKey> keys;
    for (const StepColumn& column : kColumns) keys.push_back(column.key);
    return keys;
}

std::string step_table_header() {
    std::string text;
    for (const StepColumn& column : kColumns) text.append(text.empty() ? "" : ",").append(column.key.name);
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
