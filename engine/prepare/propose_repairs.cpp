// Which repairs would fix a surface: by trying them. Each defect has its repair; where crossings are left, what lies inside something else,
// and then small loose parts, are taken out first in further tries.
#include "engine/prepare/surface_rule.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

namespace trocar::engine {

namespace {

constexpr std::size_t kMostTried = 400'000;    // triangles
constexpr std::size_t kLongestChain = 12;      // repairs
constexpr int kMostSame = 2;                   // times the same repair
constexpr int kTriedRounds = 12;               // of cutting out crossings: beyond that the repair costs too much of the surface

/// One try: a surface under repair, and what was done to it.
struct Attempt {
    TriMesh mesh;
    std::vector<Repair> done;
    std::string failure;
    bool splits = false; // what was done leaves more parts than there were

    /// To cut at edges of three or more triangles leaves what hung together there as parts: proposed with the key that allows it.
    bool apply(Repair repair, RepairOptions options) {
        const bool allowed = options.may_split;
        options.may_split = allowed || repair == Repair::DropNonManifold;
        const Result<RepairStep> step = apply_repair(mesh, repair, options);
        if (!step.ok()) {
            failure = step.error().message;
            return false;
        }
        done.push_back(repair);
        splits = splits || (!allowed && step->after.components > step->before.components);
        return true;
    }
    [[nodiscard]] bool has(Repair repair) const { return std::find(done.begin(), done.end(), repair) != done.end(); }
};

/// Borders that lie upon each other are one seam: welding them is better than filling what is between.
bool weld_closes(const Attempt& attempt, const SurfaceReport& report, const RepairOptions& options) {
    if (attempt.has(Repair::Weld)) return false;
    TriMesh welded = attempt.mesh;
    if (!apply_repair(welded, Repair::Weld, options).ok() || !apply_repair(welded, Repair::DropDuplicates, options).ok()) return false;
    const SurfaceReport after = inspect_surface(welded);
    return after.boundary_edges < report.boundary_edges && after.nonmanifold_edges <= report.nonmanifold_edges;
}

/// Repairs until nothing is wrong. before_cuts: done once before crossings are cut out, where it changes anything.
bool mend(Attempt& attempt, const SurfaceNeeds& needs, const RepairOptions& options, std::optional<Repair> before_cuts) {
    while (attempt.done.size() < kLongestChain) {
        const SurfaceReport report = inspect_surface(attempt.mesh);
        const auto defect = find_defect(attempt.mesh, report, needs);
        if (!defect) return true;
        if (!defect->repair) {
            attempt.failure = defect->what;
            return false;
        }
        Repair next = *defect->repair;
        if (next == Repair::FillHoles && weld_closes(attempt, report, options)) next = Repair::Weld;
        if (next == Repair::DropSelfIntersections && before_cuts && !attempt.has(*before_cuts)) next = *before_cuts;
        if (std::count(attempt.done.begin(), attempt.done.end(), next) >= kMostSame) {
            attempt.failure = fmt::format("{} after {}", defect->what, repair_name(next));
            return false;
        }
        const TriMesh old = attempt.mesh;
        if (!attempt.apply(next, options)) return false;
        if (before_cuts == next && old.triangles == attempt.mesh.triangles) return false; // as the try without it
    }
    return false;
}

std::string join_names(std::span<const Repair> repairs, std::string_view around, std::string_view between) {
    std::vector<std::string> names;
    for (const Repair repair : repairs) names.push_back(fmt::format("{0}{1}{0}", around, repair_name(repair)));
    return fmt::format("{}", fmt::join(names, between));
}

} // namespace

RepairAdvice propose_repairs(const TriMesh& raw, std::span<const Repair> asked, const SurfaceNeeds& needs, const RepairOptions& options) {
    if (raw.triangles.size() > kMostTried)
        return {std::nullopt, fmt::format("chains of repairs are tried on at most {} triangles", kMostTried)};
    if (const Result<void> fans = check_fans(raw); !fans.ok()) return {std::nullopt, fans.error().message};
    RepairOptions trying = options;
    trying.most_rounds = std::min(options.most_rounds, kTriedRounds);
    RepairAdvice advice;
    Attempt begun{raw, {}, {}, false};
    const bool asked_works = std::all_of(asked.begin(), asked.end(), [&](Repair repair) { return begun.apply(repair, options); });
    std::vector<Attempt> starts;
    if (asked_works && !asked.empty()) starts.push_back(begun);
    starts.push_back({raw, {}, {}, false});
    for (const Attempt& start : starts)
        for (const std::optional<Repair> before_cuts :
             {std::optional<Repair>(), std::optional(Repair::DropInnerShells), std::optional(Repair::KeepLargest)}) {
            Attempt attempt = start;
            if (mend(attempt, needs, trying, before_cuts)) {
                advice.proposal = RepairProposal{attempt.done, attempt.splits, measure_surface(raw), measure_surface(attempt.mesh)};
                return advice;
            }
            if (advice.obstacle.empty()) advice.obstacle = attempt.failure;
            const bool crossed =
                attempt.has(Repair::DropSelfIntersections) || attempt.failure.starts_with(repair_name(Repair::DropSelfIntersections));
            if (!before_cuts && !crossed) break; // it failed before there were crossings to cut out
        }
    return advice;
}

std::string describe_advice(const RepairAdvice& advice, RepairWriting writing, std::string_view told) {
    if (!advice.proposal && advice.obstacle.empty()) return "; no chain of repairs mends it";
    if (!advice.proposal)
        return "; no chain of repairs was found that mends all of it" + (advice.obstacle == told ? std::string() : ": " + advice.obstacle);
    const RepairProposal& p = *advice.proposal;
    if (p.repairs.empty()) return "; nothing else is wrong with it: none of these repairs is needed";
    const bool is_key = writing == RepairWriting::SceneKey;
    const std::string chain =
        is_key ? fmt::format("\"repair\": [{}]{}", join_names(p.repairs, "\"", ", "), p.splits ? ", \"may_split\": true" : "")
               : fmt::format("--repair {}{}", join_names(p.repairs, "", ","), p.splits ? " --may-split" : "");
    return fmt::format("; {} mends all of it: {}, triangles {} to {}", chain, describe_change(p.before, p.after), p.before.triangles,
                       p.after.triangles);
}

} // namespace trocar::engine
