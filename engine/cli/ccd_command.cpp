// `ccd`: the elementary tests on the public benchmark's files: how many of its queries are answered wrongly, and at what cost.
// A contact that is missed is exit 5; one too many is counted, since a conservative test may report it.
#include "collision/ccd/ccd.hpp"
#include "engine/cli/commands.hpp"
#include "engine/io/ccd_queries.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/time/clock.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <system_error>

namespace trocar::engine {

namespace {

struct CcdRequest {
    std::vector<std::string> files;
    std::string kind = "auto";
    unsigned repeats = 3;
};

struct Tally {
    std::size_t queries = 0, false_positives = 0, false_negatives = 0;
    std::size_t filter = 0, proof = 0, exact = 0; // which stage decided
    double total_ns = 0.0, worst_ns = 0.0;
    std::size_t first_missed = 0; // 1-based number of the first query with a false negative; 0: none

    void add(const Tally& other) {
        if (first_missed == 0 && other.first_missed > 0) first_missed = queries + other.first_missed;
        queries += other.queries;
        false_positives += other.false_positives;
        false_negatives += other.false_negatives;
        filter += other.filter;
        proof += other.proof;
        exact += other.exact;
        total_ns += other.total_ns;
        worst_ns = std::max(worst_ns, other.worst_ns);
    }
};

/// The kind from the file's name, or --kind; an Error where neither does.
Result<bool> is_vertex_face(const std::string& file, const std::string& kind) {
    if (kind != "auto") return kind == "vertex-face";
    const bool vertex_face = file.find("vertex-face") != file.npos, edge_edge = file.find("edge-edge") != file.npos;
    if (vertex_face != edge_edge) return vertex_face;
    return Error{ErrorCode::BadUsage, "the name says neither vertex-face nor edge-edge; --kind vertex-face or --kind edge-edge does", file};
}

collision::CcdResult meet(const CcdQuery& query, bool vertex_face) {
    const auto point = [&query](std::size_t i) { return collision::SweptPoint{query.rows[i], query.rows[i + 4]}; };
    if (vertex_face) return collision::ccd_vertex_face(point(0), {point(1), point(2), point(3)});
    return collision::ccd_edge_edge({point(0), point(1)}, {point(2), point(3)});
}

/// The shortest of several runs is the query's time: the rest is noise of the machine.
Tally answer(const CcdQuery& query, bool vertex_face, unsigned repeats) {
    Tally tally{.queries = 1};
    collision::CcdResult meeting;
    double best = std::numeric_limits<double>::infinity();
    for (unsigned run = 0; run < repeats; ++run) {
        const std::int64_t start = monotonic_ns();
        meeting = meet(query, vertex_face);
        best = std::min(best, static_cast<double>(monotonic_ns() - start));
    }
    tally.false_positives = meeting.meets && !query.collides;
    tally.false_negatives = !meeting.meets && query.collides;
    tally.first_missed = tally.false_negatives;
    tally.filter = meeting.decided_by == collision::Decision::Filter;
    tally.proof = meeting.decided_by == collision::Decision::Proof;
    tally.exact = meeting.decided_by == collision::Decision::Exact;
    tally.total_ns = tally.worst_ns = best;
    return tally;
}

/// A missed contact is an error: prints where it is, and the command that reproduces it.
void tell_missed(const std::string& file, const Tally& tally) {
    constexpr std::size_t kRows = 8; // of a query
    if (tally.false_negatives == 0) return;
    report_error({ErrorCode::BadValue,
                  fmt::format("found no contact in query {} of {}, expected one by its rows {} to {}; {} false negative{} in this file",
                              tally.first_missed, tally.queries, kRows * (tally.first_missed - 1) + 1, kRows * tally.first_missed,
                              tally.false_negatives, tally.false_negatives == 1 ? "" : "s"),
                  file});
}

int answer_files(const CcdRequest& request) {
    Tally total;
    std::size_t rounded = 0;
    for (const std::string& file : request.files) {
        std::error_code unknown; // of links in a circle, or a folder that may not be entered: opening the file says which
        if (!std::filesystem::is_regular_file(file, unknown)) // the kind of a missing file is irrelevant
            if (const auto opened = read_file_bytes(file); !opened) return report_error(opened.error());
        const auto vertex_face = is_vertex_face(std::filesystem::path(file).filename().string(), request.kind);
        if (!vertex_face) return report_error({vertex_face.error().code, vertex_face.error().message, file});
        const auto read = read_ccd_queries(file);
        if (!read) return report_error(read.error());
        Tally tally;
        for (const CcdQuery& query : read->queries) tally.add(answer(query, *vertex_face, request.repeats));
        fmt::print("{}: {} {} queries, {} false positives, {} false negatives, {:.0f} ns mean, {:.0f} ns worst\n", file, tally.queries,
                   *vertex_face ? "vertex-face" : "edge-edge", tally.false_positives, tally.false_negatives,
                   tally.total_ns / static_cast<double>(tally.queries), tally.worst_ns);
        tell_missed(file, tally);
        total.add(tally);
        rounded += read->rounded;
    }
    if (rounded > 0) fmt::print("{} coordinates are no doubles and were rounded: the answers are those of the rounded ones\n", rounded);
    fmt::print("decided by: filter {}, proof {}, exact arithmetic {}; the time of a query is the shortest of {} runs\n", total.filter,
               total.proof, total.exact, request.repeats);
    fmt::print("{} queries, {} false positives, {} false negatives, {:.0f} ns mean, {:.0f} ns worst\n", total.queries,
               total.false_positives, total.false_negatives, total.total_ns / static_cast<double>(total.queries), total.worst_ns);
    return total.false_negatives > 0 ? kExitDiffers : kExitFine;
}

} // namespace

Command add_ccd_command(CLI::App& app) {
    const auto request = std::make_shared<CcdRequest>();
    CLI::App* command =
        app.add_subcommand("ccd", "Answer the queries of the public CCD benchmark (CSV, plain or .gz) and compare with their truth");
    command->add_option("files", request->files, "files of eight rows a query; the name tells vertex-face or edge-edge")->required();
    command->add_option("--kind", request->kind, "what the queries are, whatever the name says")
        ->check(CLI::IsMember({"auto", "vertex-face", "edge-edge"}));
    command->add_option("--repeats", request->repeats, "runs of each query, the shortest counts")->check(CLI::Range(1u, 1000u));
    return {command, [request] { return answer_files(*request); }};
}

} // namespace trocar::engine
