// The four animations of Wong 2009: no duplicates, representative triangles, and the session search without and with skipping; the
// session's length swept; what the one heuristic switch loses. The paper's seconds stand beside.
#include "collision/search/coherent_search.hpp"
#include "collision/search/contact_search.hpp"
#include "collision/bvh/near_pairs.hpp"
#include "bench/cloth_sequences.hpp"
#include "bench/contact_workloads.hpp"
#include "bench/marked_search.hpp"
#include "bench/tables.hpp"
#include "engine/experiments/coherence_comparison.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

namespace trocar::engine {
namespace {

using collision::CoherentOptions;
using collision::SearchContact;
using collision::SurfaceMotion;

struct Animation {
    const char* name;
    ClothScene scene;
    std::size_t rigid, cloth;      // triangles in the paper
    std::array<double, 4> paper_s; // NoDup, R-TRI, without skipping, with; 0: not in it
};
constexpr Animation kSetOne[] = {{"spinning ball", ClothScene::SpinningBall, 5'200, 97'000, {0.23, 0.18, 0.15, 0.13}},
                                 {"ball-cloth", ClothScene::BallCloth, 10'000, 45'000, {0.12, 0.10, 0.082, 0.074}},
                                 {"four cones", ClothScene::FourCones, 500, 97'000, {0.31, 0.27, 0.23, 0.16}},
                                 {"garment", ClothScene::Garment, 34'000, 20'000, {0.092, 0.076, 0.062, 0.052}}};
constexpr Animation kSetTwo[] = {{"spinning ball, large", ClothScene::SpinningBall, 11'000, 320'000, {}},
                                 {"ball-cloth, large", ClothScene::BallCloth, 7'000, 500'000, {}},
                                 {"four cones, large", ClothScene::FourCones, 1'000, 502'000, {}},
                                 {"garment, large", ClothScene::Garment, 40'000, 500'000, {}}};

struct Workload {
    std::string name;
    ClothSequence frames;
    std::array<collision::SurfaceTopology, 2> topology;

    [[nodiscard]] std::array<SurfaceMotion, 2> step(std::size_t k) const {
        return {SurfaceMotion{&topology[0], frames.frames[0][k], frames.frames[0][k + 1]},
                SurfaceMotion{&topology[1], frames.frames[1][k], frames.frames[1][k + 1]}};
    }
};

Workload make_workload(const Animation& animation, std::size_t share, std::size_t steps) {
    Workload out{animation.name, make_cloth_sequence(animation.scene, animation.rigid / share, animation.cloth / share, steps), {}};
    for (std::size_t s = 0; s < 2; ++s) out.topology[s] = collision::make_topology(out.frames.triangles[s], out.frames.frames[s][0].size());
    return out;
}

/// Medians over the steps but the first, which has none before it; times of the thread.
struct Measured {
    double total_ms = 0.0, first_ms = 0.0, tests = 0.0, box_tests = 0.0, kept_clusters = 0.0, kept_features = 0.0;
    std::size_t contacts = 0, sessions = 0, bytes = 0;
    std::vector<std::uint64_t> fingerprints; // [step]
};

std::uint64_t fingerprint(std::span<const SearchContact> contacts) {
    std::uint64_t mixed = contacts.size();
    for (const SearchContact& c : contacts)
        for (const std::uint64_t part : {std::uint64_t{c.id_a} << 32 | c.id_b, std::uint64_t{c.contact.a.code()} << 16 | c.contact.b.code(),
                                         std::bit_cast<std::uint64_t>(c.contact.time)})
            mixed = (mixed ^ part) * 0x100000001b3ull;
    return mixed;
}

/// What every search has: build(surfaces, positions), step(motions, contacts), tests(), and what it keeps.
template <class Search>
Measured measure(const Workload& workload, Search& search) {
    const collision::SurfaceTopology* surfaces[] = {&workload.topology[0], &workload.topology[1]};
    const std::span<const Vec3> positions[] = {workload.frames.frames[0][0], workload.frames.frames[1][0]};
    search.build(surfaces, positions);
    Measured out;
    std::vector<double> total, tests, boxes, clusters, features;
    std::vector<SearchContact> contacts;
    for (std::size_t k = 0; k < workload.frames.step_count(); ++k) {
        const auto motions = workload.step(k);
        const std::int64_t start = thread_cpu_ns();
        search.step(motions, contacts);
        const double ms = 1e-6 * static_cast<double>(thread_cpu_ns() - start);
        (k == 0 ? out.first_ms : total.emplace_back()) = ms;
        const collision::ExactStats stats = search.stats();
        tests.push_back(static_cast<double>(stats.candidates_vf + stats.candidates_ee));
        boxes.push_back(static_cast<double>(stats.box_tests));
        const collision::CoherenceStats kept = search.coherence();
        clusters.push_back(static_cast<double>(kept.kept_clusters));
        features.push_back(static_cast<double>(kept.kept_features));
        out.sessions += kept.began_session;
        out.contacts += contacts.size();
        out.fingerprints.push_back(fingerprint(contacts));
    }
    out.total_ms = median(total);
    out.tests = median(tests);
    out.box_tests = median(boxes);
    out.kept_clusters = median(clusters);
    out.kept_features = median(features);
    out.bytes = search.memory();
    return out;
}

/// Every step anew: refit, traverse, decide.
class Anew {
public:
    explicit Anew(std::size_t cluster_size) { options_.tree.cluster_size = cluster_size; }
    void build(std::span<const collision::SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions) {
        search_.build(surfaces, positions, options_);
    }
    void step(std::span<const SurfaceMotion> motions, std::vector<SearchContact>& contacts) {
        search_.refit(motions);
        search_.find_candidates();
        search_.decide(contacts);
    }
    [[nodiscard]] const collision::ExactStats& stats() const { return search_.stats(); }
    [[nodiscard]] static collision::CoherenceStats coherence() { return {}; }
    [[nodiscard]] std::size_t memory() const {
        std::size_t sum = 0;
        for (const collision::DopTree& tree : search_.trees()) sum += tree.memory();
        return sum;
    }

private:
    collision::SearchOptions options_;
    collision::ContactSearch search_;
};

class Sessions {
public:
    explicit Sessions(const CoherentOptions& options) : options_(options) {}
    void build(std::span<const collision::SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions) {
        [[maybe_unused]] const auto built = search_.build(surfaces, positions, options_);
        assert(built.ok());
    }
    void step(std::span<const SurfaceMotion> motions, std::vector<SearchContact>& contacts) {
        [[maybe_unused]] const auto started = search_.start_step(motions);
        assert(started.ok());
        search_.find_candidates();
        search_.decide(contacts);
    }
    [[nodiscard]] const collision::ExactStats& stats() const { return search_.stats(); }
    [[nodiscard]] const collision::CoherenceStats& coherence() const { return search_.coherence(); }
    [[nodiscard]] std::size_t memory() const { return search_.memory(); }

private:
    CoherentOptions options_;
    collision::CoherentSearch search_;
};

BenchRow row_of(const Workload& workload, const std::string& method, const Measured& m) {
    return {{"animation", workload.name},
            {"rigid", workload.frames.triangles[0].size()},
            {"cloth", workload.frames.triangles[1].size()},
            {"steps", workload.frames.step_count()},
            {"method", method},
            {"exact", true},
            {"s_per_step", 1e-3 * m.total_ms},
            {"first_step_s", 1e-3 * m.first_ms},
            {"box_tests", m.box_tests},
            {"elementary_tests", m.tests},
            {"kept_cluster_pairs", m.kept_clusters},
            {"kept_feature_pairs", m.kept_features},
            {"sessions", m.sessions},
            {"megabytes", 1e-6 * static_cast<double>(m.bytes)},
            {"contacts", m.contacts}};
}

/// The methods of the paper's table, ours beside them; every exact one must find the same.
void add_methods(const Workload& workload, const Animation& animation, const BenchOptions& options, BenchTable& table) {
    std::vector<std::uint64_t> wanted;
    double rtri_ms = 0.0, clusters_ms = 0.0;
    std::size_t all_contacts = 0;
    const auto add = [&](const std::string& method, auto search, double paper_s, bool exact) {
        options.progress(fmt::format("{}: {}", workload.name, method));
        const Measured m = measure(workload, search);
        if (wanted.empty()) all_contacts = m.contacts;
        if (wanted.empty()) wanted = m.fingerprints;
        if (exact && m.fingerprints != wanted)
            table.notes.push_back(fmt::format("{}: {} finds other contacts than the first row", workload.name, method));
        if (method == "R-TRI") rtri_ms = m.total_ms;
        BenchRow row = row_of(workload, method, m);
        row["exact"] = exact;
        if (!exact) row["lost_contacts"] = all_contacts - m.contacts;
        if (rtri_ms > 0.0) row["percent_of_rtri"] = 100.0 * m.total_ms / rtri_ms;
        if (method.starts_with("clusters, anew")) clusters_ms = m.total_ms;
        if (clusters_ms > 0.0) row["percent_of_clusters_anew"] = 100.0 * m.total_ms / clusters_ms;
        if (paper_s > 0.0) row["paper_s"] = paper_s;
        if (paper_s > 0.0 && rtri_ms > 0.0) row["paper_percent"] = 100.0 * paper_s / animation.paper_s[1];
        table.rows.push_back(std::move(row));
    };
    CoherentOptions skipping, falling_back, without, paper, alone, partial, no_front_end, no_sides, cones;
    for (CoherentOptions* o : {&skipping, &paper, &alone, &partial, &no_front_end, &no_sides, &cones}) o->falls_back = false;
    no_sides.sides = false;
    cones.normal_cones = true;
    without.skipping = false;
    paper.inflation = collision::VolumeInflation::Paper;
    alone.dangling = collision::DanglingTraversal::Alone;
    partial.dangling = collision::DanglingTraversal::Partial;
    no_front_end.front_end = false;
    add("NoDup", MarkedSearch(), animation.paper_s[0], true);
    add("R-TRI", Anew(1), animation.paper_s[1], true);
    add("clusters, anew (contacts)", Anew(collision::TreeOptions{}.cluster_size), 0.0, true);
    add("without skipping", Sessions(without), animation.paper_s[2], true);
    add("with skipping", Sessions(skipping), animation.paper_s[3], true);
    add("with skipping, falling back", Sessions(falling_back), 0.0, true);
    add("with skipping, not along normals", Sessions(no_sides), 0.0, true);
    add("with skipping, the paper's inflation", Sessions(paper), 0.0, true);
    add("with skipping, dangling alone", Sessions(alone), 0.0, true);
    add("with skipping, dangling by partial traversal", Sessions(partial), 0.0, true);
    add("with skipping, no front end", Sessions(no_front_end), 0.0, true);
    add("heuristic: flat regions not against themselves", Sessions(cones), 0.0, false);
}

/// "a x f x": all sessions of one length.
void add_lengths(const Workload& workload, const BenchOptions& options, BenchTable& table) {
    for (const unsigned length : options.quick ? std::vector<unsigned>{1, 4, 16} : std::vector<unsigned>{1, 2, 4, 8, 16, 32}) {
        options.progress(fmt::format("{}: sessions of {} steps", workload.name, length));
        CoherentOptions fixed;
        fixed.falls_back = false;
        fixed.session_length = length;
        Sessions search(fixed);
        table.rows.push_back(row_of(workload, fmt::format("with skipping, sessions of {}", length), measure(workload, search)));
    }
}

/// What keeping saves on the sequences that contacts are measured on, step by step beside the search that keeps nothing.
Result<void> add_comparison(const char* name, const FrameSequence& frames, const BenchOptions& options, BenchTable& table) {
    options.progress(fmt::format("{}: with and without what is kept", name));
    const auto topology = collision::make_topology(frames.triangles, frames.vertex_count());
    const auto compared = compare_coherence(frames.frame_count - 1,
                                            [&](std::size_t k) {
                                                return std::vector<SurfaceMotion>{{&topology, frames.frame(k), frames.frame(k + 1)}};
                                            },
                                            {});
    if (!compared) return compared.error();
    if (!compared->same) table.notes.push_back(fmt::format("{}: what is kept gives other contacts", name));
    const auto plain = std::count_if(compared->steps.begin(), compared->steps.end(), [](const auto& step) { return step.plain; });
    for (const bool with_contacts : {false, true})
        table.rows.push_back(
            {{"animation", name},
             {"cloth", frames.triangles.size()},
             {"steps", with_contacts ? compared->steps_with_contacts() : compared->steps.size()},
             {"method", with_contacts ? "with skipping over contacts, steps with contacts" : "with skipping over contacts"},
             {"exact", true},
             {"share_of_anew", compared->share(with_contacts)},
             {"target", 2.0 / 3.0},
             {"reached", compared->share(with_contacts) <= 2.0 / 3.0},
             {"plain_steps", plain}});
    return {};
}

} // namespace

Result<BenchTable> bench_seed004(const BenchOptions& options) {
    BenchTable table;
    const double cell = options.quick ? 2e-3 : 0.608e-3; // of the artery's grid
    const FoldPart fold = options.quick ? FoldPart{28, 10} : FoldPart{};
    for (const auto& compared : {add_comparison("artery + catheter", make_bending_artery(cell, options.quick ? 4 : 60), options, table),
                                 add_comparison("folding cloth", make_folding_cloth(options.quick ? 16 : 100, 160, fold), options, table)})
        if (!compared) return compared.error();
    const auto add_set = [&](std::span<const Animation> set, std::size_t share, std::size_t steps) {
        for (const Animation& animation : set) {
            options.progress(fmt::format("{}: moving the cloth", animation.name));
            const Workload workload = make_workload(animation, share, steps);
            add_methods(workload, animation, options, table);
            add_lengths(workload, options, table);
        }
    };
    add_set(kSetOne, options.quick ? 20 : 1, options.quick ? 8 : 24);
    if (options.large) add_set(kSetTwo, options.quick ? 40 : 1, options.quick ? 4 : 8);
    table.notes.push_back(
        fmt::format("share_of_anew: processor time of all steps' sum, step by step beside a search that keeps nothing; boxes are "
                    "tested on {}, wider registers speed the latter up more",
                    collision::near_pairs_target()));
    table.notes.push_back("times: medians of a step after the first, of the thread, all on one thread; self-contact included");
    table.notes.push_back(
        "paper_s: Wong (2009), table of experiment set one, Core 2 Quad at 2.4 GHz, its own sequences; set two has plots only");
    table.notes.push_back(
        "where the shape differs: clusters of 32 triangles tested 16 features at a time leave less to save than single "
        "triangles did, and where cloth lies pressed on a solid its lists are long and short-lived, so skipping gains little there");
    table.notes.push_back("NoDup: pairs of triangles, features marked as tested; R-TRI: trees down to one triangle that owns its features");
    if (!options.large) table.notes.push_back("set two (320K to 502K triangles) was left out; --large runs it");
    return table;
}

} // namespace trocar::engine
