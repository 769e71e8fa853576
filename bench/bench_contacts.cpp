// Exact contacts beside FCL, CGAL and Embree on the same frames: each stage's time, hierarchy by hierarchy, growth from 10K to 1M
// triangles, one thread and two.
#include "collision/search/contact_search.hpp"
#include "collision/bvh/near_pairs.hpp"
#include "bench/contact_workloads.hpp"
#include "bench/bench.hpp"
#include "bench/tables.hpp"
#include "engine/prepare/process.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace trocar::engine {

namespace {

using collision::ContactSearch;
using collision::SearchContact;
using collision::SearchOptions;

struct Workload {
    std::string name;
    FrameSequence frames;
};

/// What one search costs over all steps: medians. One thread: the thread's own time; more: the wall's.
struct Measured {
    double build_ms = 0.0, refit_ms = 0.0, broad_ms = 0.0, narrow_ms = 0.0, total_ms = 0.0;
    double candidates_vf = 0.0, candidates_ee = 0.0, hits = 0.0; // medians; hits over all steps
    std::uint64_t exact = 0;
    std::vector<std::uint64_t> fingerprints; // [step] of all contacts up to its end
    std::size_t tree_bytes = 0;
};

/// Order and bits of every contact: equal for equal answers.
std::uint64_t mix(std::uint64_t seed, std::span<const SearchContact> contacts) {
    for (const SearchContact& c : contacts)
        for (const std::uint64_t part : {std::uint64_t{c.id_a} << 32 | c.id_b, std::bit_cast<std::uint64_t>(c.contact.time),
                                         std::bit_cast<std::uint64_t>(c.contact.normal[0])})
            seed = (seed ^ part) * 0x100000001b3ull;
    return seed;
}

/// steps   from the first one, or all
Measured measure(const FrameSequence& frames, const collision::SurfaceTopology& topology, const SearchOptions& options,
                 std::size_t most_steps = SIZE_MAX) {
    const auto now_ms = [&] { return 1e-6 * static_cast<double>(options.threads > 1 ? monotonic_ns() : thread_cpu_ns()); };
    Measured out;
    ContactSearch search;
    const collision::SurfaceTopology* surface = &topology;
    const std::span<const Vec3> first = frames.frame(0);
    const double start = now_ms();
    search.build({&surface, 1}, {&first, 1}, options);
    out.build_ms = now_ms() - start;
    std::vector<double> refit, broad, narrow, total, vf, ee;
    std::vector<SearchContact> contacts;
    for (std::size_t k = 0; k < std::min(most_steps, frames.frame_count - 1); ++k) {
        const collision::SurfaceMotion motion{&topology, frames.frame(k), frames.frame(k + 1)};
        const double begin = now_ms();
        search.refit({&motion, 1});
        const double refitted = now_ms();
        search.find_candidates();
        const double found = now_ms();
        search.decide(contacts);
        const double end = now_ms();
        refit.push_back(refitted - begin);
        broad.push_back(found - refitted);
        narrow.push_back(end - found);
        total.push_back(end - begin);
        vf.push_back(static_cast<double>(search.stats().candidates_vf));
        ee.push_back(static_cast<double>(search.stats().candidates_ee));
        out.hits += static_cast<double>(contacts.size());
        out.exact += search.stats().exact;
        out.fingerprints.push_back(mix(out.fingerprints.empty() ? 0 : out.fingerprints.back(), contacts));
    }
    out.refit_ms = median(refit);
    out.broad_ms = median(broad);
    out.narrow_ms = median(narrow);
    out.total_ms = median(total);
    out.candidates_vf = median(vf);
    out.candidates_ee = median(ee);
    out.tree_bytes = search.trees()[0].memory();
    return out;
}

BenchRow row_of(const Workload& workload, const std::string& method, unsigned threads, const Measured& m) {
    const auto triangles = static_cast<double>(workload.frames.triangles.size());
    return {{"workload", workload.name},
            {"triangles", workload.frames.triangles.size()},
            {"steps", m.fingerprints.size()},
            {"method", method},
            {"peer", false},
            {"threads", threads},
            {"candidates_vf", m.candidates_vf},
            {"candidates_ee", m.candidates_ee},
            {"hits_total", m.hits},
            {"exact_total", m.exact},
            {"build_ms", m.build_ms},
            {"refit_ms", m.refit_ms},
            {"broad_ms", m.broad_ms},
            {"refit_and_broad_ms", m.refit_ms + m.broad_ms},
            {"narrow_ms", m.narrow_ms},
            {"total_ms", m.total_ms},
            {"ns_per_candidate", 1e6 * m.narrow_ms / std::max(1.0, m.candidates_vf + m.candidates_ee)},
            {"tree_bytes_per_triangle", static_cast<double>(m.tree_bytes) / triangles},
            {"fingerprint", fmt::format("{:016x}", m.fingerprints.back())}};
}

/// A combination of techniques; each but the first changes one.
struct Method {
    std::string name;
    collision::TreeOptions tree;
    bool simd = true;
};

std::vector<Method> methods(bool quick) {
    using collision::TreeBuilder;
    const collision::TreeOptions usual;
    const auto with = [&](auto change) {
        collision::TreeOptions tree = usual;
        change(tree);
        return tree;
    };
    std::vector<Method> list{{fmt::format("dop6-arity8-sah-cluster{} (default)", usual.cluster_size), usual},
                             {"without SIMD", usual, false}};
    if (quick) return list;
    list.push_back({"fine: a second look", with([](auto& t) { t.fine = true; })});
    for (const std::size_t k : {14, 18, 26}) list.push_back({fmt::format("dop{}", k), with([k](auto& t) { t.dop = k; })});
    list.push_back({"arity4", with([](auto& t) { t.arity = 4; })});
    list.push_back({"arity2", with([](auto& t) { t.arity = 2; })});
    list.push_back({"median splits", with([](auto& t) { t.builder = TreeBuilder::Median; })});
    list.push_back({"the paper's splits", with([](auto& t) { t.builder = TreeBuilder::Middle; })});
    list.push_back({"cluster16", with([](auto& t) { t.cluster_size = 16; })});
    list.push_back({"cluster8", with([](auto& t) { t.cluster_size = 8; })});
    list.push_back({"cluster1", with([](auto& t) { t.cluster_size = 1; })});
    list.push_back({"the paper's tree: dop18-arity4-cluster1", {.dop = 18, .arity = 4, .cluster_size = 1, .builder = TreeBuilder::Middle}});
    return list;
}

SearchOptions options_of(const Method& method, unsigned threads) {
    SearchOptions options;
    options.tree = method.tree;
    options.simd = method.simd;
    options.threads = threads;
    return options;
}

/// Peer programs and their modes. What they answer stands in their rows: hits_total of a broad phase is 0.
struct Peer {
    const char* program;
    std::vector<std::string> modes;
    const char* package;
};
const std::vector<Peer>& peers() {
    static const std::vector<Peer> all{{"embree_contacts", {"low", "refit"}, "libembree-dev"},
                                       {"cgal_contacts", {"box"}, "libcgal-dev"},
                                       {"fcl_contacts", {"aabb", "kdop18"}, "libfcl-dev"}};
    return all;
}

constexpr double kPeerLimit = 600.0; // s

void add_peers(const Workload& workload, const BenchOptions& options, BenchTable& table) {
    const auto folder = TemporaryFolder::make();
    if (!folder) return table.notes.push_back("peers not run: " + folder.error().to_string());
    if (const auto written = write_frames(folder->path(), workload.frames); !written)
        return table.notes.push_back("peers not run: " + written.error().to_string());
    for (const Peer& peer : peers()) {
        const auto program = find_peer(peer.program);
        if (!program) {
            const std::string note = fmt::format("{} was not built: package {} is missing", peer.program, peer.package);
            if (std::find(table.notes.begin(), table.notes.end(), note) == table.notes.end()) table.notes.push_back(note);
            continue;
        }
        for (const std::string& mode : peer.modes) {
            options.progress(fmt::format("{}: {} {}", workload.name, peer.program, mode));
            const auto outcome = run_process(*program, {folder->path().string(), mode}, folder->path(), kPeerLimit);
            const auto json = outcome.ok() && outcome->exit_code == 0 ? BenchRow::parse(outcome->output, nullptr, false) : BenchRow();
            if (!json.is_object()) {
                table.notes.push_back(fmt::format("{} {} failed on {}", peer.program, mode, workload.name));
                continue;
            }
            BenchRow row{{"workload", workload.name},
                         {"triangles", workload.frames.triangles.size()},
                         {"steps", workload.frames.frame_count - 1},
                         {"method", json["method"]},
                         {"peer", true},
                         {"threads", 1}};
            for (const char* key : {"candidates_vf", "candidates_ee", "hits_total", "refit_ms", "broad_ms"}) row[key] = json[key];
            row["refit_and_broad_ms"] = json["refit_ms"].get<double>() + json["broad_ms"].get<double>();
            row["narrow_ms"] = json["narrow_ms"];
            row["total_ms"] = json["total_ms"];
            table.rows.push_back(row);
        }
    }
}

/// Proxy for LBVH with Tight-Inclusion, which no Debian package has: its whole step over Embree's broad phase, both measured
/// on one machine (4 GHz, AVX-512, one thread). On another machine Embree beside scales it.
struct Anchor {
    std::string_view workload;
    double whole_over_embree;
};
constexpr Anchor kAnchors[] = {{"artery + catheter", 512.0 / 106.0}, {"touching cloth", 118.0 / 31.0}};
/// Targets: broad phase over the best peer that answers the same question; whole step over LBVH with Tight-Inclusion.
constexpr double kBroadTarget = 1.0 / 3.0, kWholeTarget = 1.0 / 8.0, kGrowthTarget = 1.2;

BenchRow target_row(const BenchRow& ours, const std::string& what, double measured, double target) {
    return {{"workload", ours["workload"]},
            {"triangles", ours["triangles"]},
            {"steps", ours["steps"]},
            {"method", what},
            {"peer", false},
            {"threads", ours["threads"]},
            {"measured", measured},
            {"target", target},
            {"reached", measured <= target}};
}

/// What the first row of a workload, the default method on one thread, comes to beside the peers.
void add_targets(const std::string& workload, BenchTable& table) {
    const BenchRow* ours = nullptr;
    double best = 0.0, embree = 0.0;
    for (const BenchRow& row : table.rows) {
        if (row["workload"] != workload) continue;
        if (ours == nullptr) ours = &row;
        const auto method = row["method"].get<std::string>();
        if (!row["peer"].get<bool>() || method.find("fcl") != method.npos) continue; // FCL: triangle pairs
        const double broad = row["refit_and_broad_ms"].get<double>();
        if (best == 0.0 || broad < best) best = broad;
        if (method.find("low") != method.npos) embree = broad;
    }
    if (ours == nullptr || best == 0.0) return;
    const BenchRow first = *ours; // the rows grow
    table.rows.push_back(
        target_row(first, "broad phase over the best peer's", first["refit_and_broad_ms"].get<double>() / best, kBroadTarget));
    for (const Anchor& anchor : kAnchors)
        if (anchor.workload == workload && embree > 0.0)
            table.rows.push_back(target_row(first, "whole step over LBVH + Tight-Inclusion (by Embree beside)",
                                            first["total_ms"].get<double>() / (anchor.whole_over_embree * embree), kWholeTarget));
}

/// Steps on which the methods beside the default are compared: a bench of minutes.
constexpr std::size_t kMethodSteps = 12;

void add_workload(const Workload& workload, const BenchOptions& options, BenchTable& table) {
    const auto topology = collision::make_topology(workload.frames.triangles, workload.frames.vertex_count());
    const std::vector<Method> all = methods(options.quick);
    std::vector<std::uint64_t> wanted; // the first row's
    const auto add = [&](const Method& method, unsigned threads, std::size_t steps) {
        options.progress(fmt::format("{}: {}, {} threads", workload.name, method.name, threads));
        const Measured m = measure(workload.frames, topology, options_of(method, threads), steps);
        if (wanted.empty()) wanted = m.fingerprints;
        if (!std::equal(m.fingerprints.begin(), m.fingerprints.end(), wanted.begin()))
            table.notes.push_back(
                fmt::format("{}: {} with {} threads gives other contacts than the first row", workload.name, method.name, threads));
        table.rows.push_back(row_of(workload, method.name, threads, m));
    };
    add(all[0], 1, SIZE_MAX);
    add(all[0], options.threads == 0 ? 2 : options.threads, SIZE_MAX);
    for (std::size_t i = 1; i < all.size(); ++i) add(all[i], 1, kMethodSteps);
    add_peers(workload, options, table);
    add_targets(workload.name, table);
}

/// Part of the fold in which the pleats touch.
constexpr FoldPart kTouching{34, 6};

/// The touching cloth at growing width: the same motion and density of contacts.
void add_growth(const BenchOptions& options, BenchTable& table) {
    double first_ms = 0.0, first_size = 0.0;
    const std::vector<std::size_t> columns =
        options.quick ? std::vector<std::size_t>{32, 64} : std::vector<std::size_t>{32, 100, 320, 1000, 3200};
    for (const std::size_t count : columns) {
        Workload workload;
        workload.name = "growth";
        workload.frames = make_folding_cloth(count, 160, kTouching);
        options.progress(fmt::format("growth: {} triangles", workload.frames.triangles.size()));
        const auto topology = collision::make_topology(workload.frames.triangles, workload.frames.vertex_count());
        const Method method = methods(true)[0];
        const Measured m = measure(workload.frames, topology, options_of(method, 1));
        BenchRow row = row_of(workload, method.name, 1, m);
        const auto size = static_cast<double>(workload.frames.triangles.size());
        row["hits_per_triangle"] = m.hits / size / static_cast<double>(kTouching.steps);
        if (first_ms > 0.0) {
            row["measured"] = std::log(m.total_ms / first_ms) / std::log(size / first_size);
            row["target"] = kGrowthTarget;
            row["reached"] = row["measured"].get<double>() <= kGrowthTarget;
        }
        if (first_ms == 0.0) {
            first_ms = m.total_ms;
            first_size = size;
        }
        table.rows.push_back(row);
    }
}

} // namespace

Result<BenchTable> bench_contacts(const BenchOptions& options) {
    BenchTable table;
    options.progress("making the meshes");
    if (!options.quick) add_workload({"artery + catheter", make_bending_artery(0.608e-3, 60)}, options, table);
    if (!options.quick) add_workload({"folding cloth", make_folding_cloth(100, 160)}, options, table);
    add_workload({"touching cloth", make_folding_cloth(options.quick ? 30 : 100, 160, options.quick ? FoldPart{34, 3} : FoldPart{30, 25})},
                 options, table);
    add_growth(options, table);
    table.notes.push_back(
        fmt::format("times: medians of a step, of the thread (peers: process) with one thread, of the wall with more; broad phase on {}",
                    collision::near_pairs_target()));
    table.notes.push_back(
        "embree, cgal: broad phase only. fcl: its own cubic with absolute tolerances, which misses contacts of small meshes");
    table.notes.push_back("elsewhere (4 GHz, AVX-512, one thread): LBVH + Tight-Inclusion 512 ms a step on artery + catheter, 118 ms on "
                          "cloth with contact; Embree's broad phase 106 and 31");
    table.notes.push_back(
        "measured, of growth: exponent of total_ms over triangles, against the smallest mesh; elsewhere the ratio that the row names");
    return table;
}

} // namespace trocar::engine
