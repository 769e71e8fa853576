// Table 1 of "Hierarchical techniques in collision detection for cloth animation" (Mezger, Kimmerle, Etzmuss 2003): a walking figure in
// trousers, the accelerated set and its ablations, and every other switch of the search, each with what it loses.
#include "collision/proximity_search.hpp"
#include "engine/bench/tables.hpp"
#include "engine/bench/walking_figure.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace seldinger::engine {

namespace {

using collision::Coherence;
using collision::Exactness;
using collision::Inflation;
using collision::LeafTest;
using collision::NormalCones;
using collision::Proximity;
using collision::ProximityOptions;
using collision::ProximitySearch;
using collision::SurfaceMotion;
using collision::SurfaceTopology;

constexpr double kClose = 5e-3; // m, d_close
constexpr BodyId kFigure = 0, kCloth = 1;

/// The paper's seconds for 600 steps: hierarchy update, collision test, both. Its machine is not named in the part that was at hand.
struct PaperRow {
    int refit, test, total;
};

struct Setup {
    std::string name;
    ProximityOptions options;
    const char* differs = ""; // one sentence, where the shape is not the paper's
    std::optional<PaperRow> paper = std::nullopt;
};

/// The paper's: 18-DOPs, quadtrees, oriented inflation, cones with groups, leaf angle.
ProximityOptions accelerated() {
    ProximityOptions o;
    o.distance = o.self_distance = kClose;
    o.within = 1u << kCloth;
    o.dop = 18;
    o.arity = 4;
    o.inflation = Inflation::OrientedSafe;
    o.normal_cones = NormalCones::Groups;
    o.group_count = 32;
    o.leaf_angle = 0.5;
    return o;
}

/// The same without anything that may lose a proximity: what the losses are counted against.
ProximityOptions exact_set() {
    ProximityOptions o = accelerated();
    o.normal_cones = NormalCones::Off;
    o.leaf_angle = 0.0;
    return o;
}

template <class Change>
Setup changed(std::string name, ProximityOptions base, Change change, const char* differs = "", std::optional<PaperRow> paper = {}) {
    change(base);
    return {std::move(name), base, differs, paper};
}

std::vector<Setup> make_setups() {
    const ProximityOptions all = accelerated(), exact = exact_set();
    std::vector<Setup> setups{{"exact reference: 18-DOP, quadtree, oriented, no heuristic", exact}};
    const auto add = [&](Setup setup) { setups.push_back(std::move(setup)); };
    add({"accelerated: 18-DOP, quadtree, oriented", all, "", PaperRow{56, 31, 88}});
    add(changed(
        "unoriented", all, [](auto& o) { o.inflation = Inflation::Plain; }, "", PaperRow{37, 136, 173}));
    add(changed(
        "AABB", all, [](auto& o) { o.dop = 6; }, "", PaperRow{43, 50, 93}));
    add(changed(
        "binary tree", all, [](auto& o) { o.arity = 2; }, "", PaperRow{64, 35, 99}));
    add(changed("octree", all, [](auto& o) { o.arity = 8; }));
    add(changed("14-DOP", all, [](auto& o) { o.dop = 14; }));
    add(changed("26-DOP", all, [](auto& o) { o.dop = 26; }));
    add(changed("oriented by the mean axis alone", all, [](auto& o) { o.inflation = Inflation::OrientedPaper; }));
    add(changed("extrapolated vertices", all, [](auto& o) { o.inflation = Inflation::Swept; }));
    add(changed("extrapolated vertices, octree, AABB", all, [](auto& o) {
        o.inflation = Inflation::Swept;
        o.arity = 8;
        o.dop = 6;
    }));
    for (const double mm : {2.0, 20.0})
        add(changed(fmt::format("lazy refit, {} mm", mm), all, [&](auto& o) { o.lazy_tolerance = 1e-3 * mm; }));
    add(changed("without cones and leaf angle", all, [](auto& o) {
        o.normal_cones = NormalCones::Off;
        o.leaf_angle = 0.0;
    }));
    add(changed("without leaf angle", all, [](auto& o) { o.leaf_angle = 0.0; }));
    add(changed("cones without groups", all, [](auto& o) { o.normal_cones = NormalCones::Alone; }));
    add(changed("cones with contours", all, [](auto& o) {
        o.normal_cones = NormalCones::Contour;
        o.leaf_angle = 0.0;
    }));
    add(changed("separation list", all, [](auto& o) { o.coherence = Coherence::SeparationList; }));
    for (const double mm : {0.5, 2.0})
        add(changed(fmt::format("velocity cones' reuse, {} mm", mm), all, [&](auto& o) {
            o.coherence = Coherence::VelocityCones;
            o.reuse_limit = 1e-3 * mm;
        }));
    add(changed("vertices of the cloth alone", all, [](auto& o) { o.leaf_test = LeafTest::Vertices; }));
    // what meets the cloth itself, decided exactly
    const auto touching = [](ProximityOptions o) {
        o.self_distance = 0.0;
        o.between = false;
        return o;
    };
    add(changed("cloth on cloth, touching: no cones", touching(exact), [](auto&) {}));
    add(changed("cloth on cloth, touching: cones with contours", touching(exact), [](auto& o) { o.normal_cones = NormalCones::Contour; }));
    add(changed("cloth on cloth, touching: cones with groups", touching(exact), [](auto& o) { o.normal_cones = NormalCones::Groups; }));
    return setups;
}

/// The cloth's frames, and the figure's on request: all of them would be too much to keep.
class Walk {
public:
    explicit Walk(std::size_t steps)
        : figure_topology_(collision::make_topology(figure_.triangles(), figure_.vertex_count())), steps_(steps) {
        Trousers trousers;
        cloth_topology_ = collision::make_topology(trousers.triangles(), trousers.positions().size());
        for (std::size_t k = 0; k <= steps; ++k) {
            cloth_.emplace_back(trousers.positions().begin(), trousers.positions().end());
            trousers.advance();
        }
    }
    [[nodiscard]] std::size_t steps() const noexcept { return steps_; }
    [[nodiscard]] const SurfaceTopology& figure() const noexcept { return figure_topology_; }
    [[nodiscard]] const SurfaceTopology& cloth() const noexcept { return cloth_topology_; }

    /// Goes to a step; steps in order cost one skin each.
    std::array<SurfaceMotion, 2> at(std::size_t step) {
        if (skin_step_ + 1 == step)
            std::swap(skin_t0_, skin_t1_);
        else
            figure_.place_skin(WalkingFigure::kStep * static_cast<double>(step), skin_t0_);
        figure_.place_skin(WalkingFigure::kStep * static_cast<double>(step + 1), skin_t1_);
        skin_step_ = step;
        return {SurfaceMotion{&figure_topology_, skin_t0_, skin_t1_}, SurfaceMotion{&cloth_topology_, cloth_[step], cloth_[step + 1]}};
    }

private:
    WalkingFigure figure_;
    SurfaceTopology figure_topology_, cloth_topology_;
    std::size_t steps_, skin_step_ = ~std::size_t{1};
    std::vector<std::vector<Vec3>> cloth_;
    std::vector<Vec3> skin_t0_, skin_t1_;
};

/// Which faces: bodies and both ids in one number, in the order of a search's answer.
using Keys = std::vector<std::uint64_t>;
Keys keys_of(const std::vector<Proximity>& found) {
    Keys keys;
    for (const Proximity& p : found)
        keys.push_back(std::uint64_t{p.body_a} << 63 | std::uint64_t{p.body_b} << 62 | std::uint64_t{p.face_a} << 31 | p.face_b);
    std::sort(keys.begin(), keys.end());
    return keys;
}

struct Totals {
    double refit_s = 0.0, test_s = 0.0;
    std::uint64_t near = 0, self_near = 0, lost = 0, invented = 0;
    collision::ProximityStats stats;
    std::uint64_t slots = 0;
    std::size_t memory = 0;
};

/// truth   [step] filled by the first setup of its kind, then compared with
Result<Totals> run(Walk& walk, const ProximityOptions& options, std::vector<Keys>& truth) {
    ProximitySearch search;
    const auto first = walk.at(0);
    const SurfaceTopology* surfaces[] = {&walk.figure(), &walk.cloth()};
    const std::span<const Vec3> positions[] = {first[0].t0, first[1].t0};
    if (auto built = search.build(surfaces, positions, options); !built) return built.error();
    const bool is_truth = truth.empty();
    Totals totals;
    std::vector<Proximity> found;
    for (std::size_t k = 0; k < walk.steps(); ++k) {
        const auto motions = walk.at(k);
        const std::int64_t start = thread_cpu_ns();
        if (auto fitted = search.refit(motions); !fitted) return fitted.error();
        const std::int64_t middle = thread_cpu_ns();
        search.find(found);
        const std::int64_t end = thread_cpu_ns();
        totals.refit_s += 1e-9 * static_cast<double>(middle - start);
        totals.test_s += 1e-9 * static_cast<double>(end - middle);
        totals.stats.add(search.stats());
        totals.slots += search.refit_stats().slots;
        totals.near += found.size();
        for (const Proximity& p : found) totals.self_near += p.body_a == p.body_b;
        Keys keys = keys_of(found), rest;
        if (is_truth) {
            truth.push_back(std::move(keys));
            continue;
        }
        std::set_difference(truth[k].begin(), truth[k].end(), keys.begin(), keys.end(), std::back_inserter(rest));
        totals.lost += rest.size();
        rest.clear();
        std::set_difference(keys.begin(), keys.end(), truth[k].begin(), truth[k].end(), std::back_inserter(rest));
        totals.invented += rest.size();
    }
    totals.memory = search.memory();
    return totals;
}

BenchRow make_row(const Setup& setup, const Totals& totals, const std::vector<Keys>& truth) {
    std::size_t true_ones = 0;
    for (const Keys& keys : truth) true_ones += keys.size();
    BenchRow row;
    row["setup"] = setup.name;
    row["label"] = collision::exactness_of(setup.options) == Exactness::Exact ? "exact" : "heuristic";
    row["refit_s"] = totals.refit_s;
    row["test_s"] = totals.test_s;
    row["total_s"] = totals.refit_s + totals.test_s;
    row["paper_refit_s"] = setup.paper ? BenchRow(setup.paper->refit) : BenchRow(nullptr);
    row["paper_test_s"] = setup.paper ? BenchRow(setup.paper->test) : BenchRow(nullptr);
    row["paper_total_s"] = setup.paper ? BenchRow(setup.paper->total) : BenchRow(nullptr);
    row["near"] = totals.near;
    row["self_near"] = totals.self_near;
    row["lost"] = totals.lost;
    row["lost_percent"] = true_ones > 0 ? 100.0 * static_cast<double>(totals.lost) / static_cast<double>(true_ones) : 0.0;
    row["invented"] = totals.invented;
    row["box_tests"] = totals.stats.box_tests;
    row["face_tests"] = totals.stats.face_tests;
    row["nodes_refitted"] = totals.slots;
    row["cone_skips"] = totals.stats.cone_skips;
    row["contour_tests"] = totals.stats.contour_tests;
    row["list_pairs"] = totals.stats.list_pairs;
    row["results_kept"] = totals.stats.kept_near;
    row["memory_mb"] = 1e-6 * static_cast<double>(totals.memory);
    return row;
}

} // namespace

Result<BenchTable> bench_seed001(const BenchOptions& options) {
    BenchTable table;
    options.progress("trousers: hanging them on the figure");
    Walk walk(options.quick ? 12 : 600);
    std::vector<Keys> truth, touching_truth;
    for (const Setup& setup : make_setups()) {
        options.progress(setup.name);
        auto& compared = setup.options.between ? truth : touching_truth;
        const auto totals = run(walk, setup.options, compared);
        if (!totals) return totals.error();
        table.rows.push_back(make_row(setup, *totals, compared));
        if (setup.differs[0] != '\0') table.notes.push_back(fmt::format("{}: {}", setup.name, setup.differs));
    }
    return table;
}

} // namespace seldinger::engine
