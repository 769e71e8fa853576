// Table 1 of "Hierarchical techniques in collision detection for cloth animation" (Mezger, Kimmerle, Etzmuss 2003): a walking figure in
// trousers, the accelerated set and its ablations, and every other switch of the search, each with what it loses.
#include "collision/proximity/proximity_search.hpp"
#include "bench/tables.hpp"
#include "bench/walking_figure.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

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
constexpr collision::SurfaceIndex kFigure = 0, kCloth = 1;

/// The paper's seconds for 600 steps: hierarchy update, collision test, both. Its machine is not named in the part that was available.
struct ProximityRow {
    int refit, test, total;
};

/// One sentence for each of the paper's rows, where the shape of ours is not its.
constexpr const char* kWhereShapesDiffer[] = {
    "accelerated: the paper spends more on refitting than on testing, here it is the other way round, for a near pair is decided for the "
    "whole step and not for one instant, and refitting runs over arrays",
    "unoriented: the same shape, a cheaper refit and far more tests; it grows by the fastest vertex of the surface, a swinging foot's, "
    "where "
    "the paper's offset was chosen manually",
    "AABB: the paper's lose by their tests; here they lose as many tests and win as much by the refit, since oriented inflation costs "
    "every direction the same and a box is tested against all children of a node at once",
    "binary tree: the same shape, more nodes to refit and no fewer tests",
    "extrapolated vertices: the paper calls them twice the cost of the leaves and inflates by cones instead; here vertices are projected "
    "once for all their faces, so they are several times cheaper than cones, and tighter",
};

enum class FigureScene : std::uint8_t { Walking, Standing, WalkingCloth }; // WalkingCloth: the cloth against itself alone
constexpr const char* kSceneNames[] = {"walking", "standing", "walking, cloth on cloth"};

struct Setup {
    std::string name;
    ProximityOptions options;
    std::optional<ProximityRow> paper = std::nullopt;
    FigureScene scene = FigureScene::Walking;
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

/// All that a method of vertices against faces can name: pairs of faces of which a vertex of the one comes near the other.
constexpr const char* kNameable = "vertices of the cloth alone: no cones, no leaf angle";

/// Rows are told from each other by one change of a set.
class Setups {
public:
    std::vector<Setup> all;
    FigureScene scene = FigureScene::Walking;

    Setup& add(std::string name, const ProximityOptions& options) {
        all.push_back({std::move(name), options, std::nullopt, scene});
        return all.back();
    }
    template <class Change>
    Setup& add(std::string name, ProximityOptions options, Change change) {
        change(options);
        return add(std::move(name), options);
    }
};

void add_ablations(Setups& setups) {
    const ProximityOptions set = accelerated();
    setups.add("accelerated: 18-DOP, quadtree, oriented", set).paper = ProximityRow{56, 31, 88};
    setups.add("unoriented", set, [](auto& o) { o.inflation = Inflation::Plain; }).paper = ProximityRow{37, 136, 173};
    setups.add("AABB", set, [](auto& o) { o.dop = 6; }).paper = ProximityRow{43, 50, 93};
    setups.add("binary tree", set, [](auto& o) { o.arity = 2; }).paper = ProximityRow{64, 35, 99};
    setups.add("octree", set, [](auto& o) { o.arity = 8; });
    setups.add("14-DOP", set, [](auto& o) { o.dop = 14; });
    setups.add("26-DOP", set, [](auto& o) { o.dop = 26; });
    setups.add("oriented by the mean axis alone", set, [](auto& o) { o.inflation = Inflation::OrientedPaper; });
    setups.add("extrapolated vertices", set, [](auto& o) { o.inflation = Inflation::Swept; });
    setups.add("extrapolated vertices, octree, AABB", set, [](auto& o) {
        o.inflation = Inflation::Swept;
        o.arity = 8;
        o.dop = 6;
    });
    setups.add(kNameable, exact_set(), [](auto& o) { o.leaf_test = LeafTest::Vertices; });
    setups.add("vertices of the cloth alone (figure 8)", set, [](auto& o) { o.leaf_test = LeafTest::Vertices; });
}

void add_cones(Setups& setups) {
    const ProximityOptions set = accelerated();
    setups.add("without leaf angle", set, [](auto& o) { o.leaf_angle = 0.0; });
    setups.add("cones without groups", set, [](auto& o) { o.normal_cones = NormalCones::Alone; });
    setups.add("cones with contours, no leaf angle", set, [](auto& o) {
        o.normal_cones = NormalCones::Contour;
        o.leaf_angle = 0.0;
    });
}

void add_coherence(Setups& setups) {
    const ProximityOptions set = accelerated();
    for (const double mm : {0.5, 5.0})
        setups.add(fmt::format("lazy refit, {} mm", mm), set, [&](auto& o) { o.lazy_tolerance = 1e-3 * mm; });
    setups.add("separation list", set, [](auto& o) { o.coherence = Coherence::SeparationList; });
    for (const double mm : {0.5, 2.0})
        setups.add(fmt::format("velocity cones' reuse, {} mm", mm), set, [&](auto& o) {
            o.coherence = Coherence::VelocityCones;
            o.reuse_limit = 1e-3 * mm;
        });
}

/// What meets the cloth itself, decided exactly: where cones with contours are exact as well.
void add_touching(Setups& setups) {
    ProximityOptions exact = exact_set();
    exact.self_distance = 0.0;
    exact.between = false;
    setups.add("touching: exact reference, no cones", exact);
    setups.add("touching: cones with contours", exact, [](auto& o) { o.normal_cones = NormalCones::Contour; });
    setups.add("touching: cones with groups", exact, [](auto& o) { o.normal_cones = NormalCones::Groups; });
}

/// The first setup of each scene is what the others' losses are counted against.
std::vector<Setup> make_setups() {
    Setups setups;
    setups.add("exact reference: no cones, no leaf angle", exact_set());
    add_ablations(setups);
    add_cones(setups);
    add_coherence(setups);
    setups.scene = FigureScene::Standing;
    setups.add("exact reference: no cones, no leaf angle", exact_set());
    setups.add("accelerated: 18-DOP, quadtree, oriented", accelerated());
    add_coherence(setups);
    setups.scene = FigureScene::WalkingCloth;
    add_touching(setups);
    return setups.all;
}

/// The cloth's frames, and the figure's on request: all of them would be too much to keep.
class Walk {
public:
    Walk(std::size_t steps, bool walks)
        : figure_topology_(collision::make_topology(figure_.triangles(), figure_.vertex_count())), steps_(steps), walks_(walks) {
        Trousers trousers(walks);
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
            place_skin(step, skin_t0_);
        place_skin(step + 1, skin_t1_);
        skin_step_ = step;
        return {SurfaceMotion{&figure_topology_, skin_t0_, skin_t1_}, SurfaceMotion{&cloth_topology_, cloth_[step], cloth_[step + 1]}};
    }

private:
    void place_skin(std::size_t step, std::vector<Vec3>& skin) const {
        figure_.place_skin(walks_ ? WalkingFigure::kStep * static_cast<double>(step) : WalkingFigure::kStanding, skin);
    }

    WalkingFigure figure_;
    SurfaceTopology figure_topology_, cloth_topology_;
    std::size_t steps_, skin_step_ = ~std::size_t{1};
    bool walks_;
    std::vector<std::vector<Vec3>> cloth_;
    std::vector<Vec3> skin_t0_, skin_t1_;
};

/// Which faces: bodies and both ids in one number, in the order of a search's answer.
using Keys = std::vector<std::uint64_t>;
Keys keys_of(const std::vector<Proximity>& found) {
    Keys keys;
    for (const Proximity& p : found)
        keys.push_back(std::uint64_t{p.surface_a} << 63 | std::uint64_t{p.surface_b} << 62 | std::uint64_t{p.face_a} << 31 | p.face_b);
    std::sort(keys.begin(), keys.end());
    return keys;
}

struct Totals {
    double refit_s = 0.0, test_s = 0.0;
    std::uint64_t near = 0, self_near = 0, lost = 0, invented = 0;
    std::uint64_t nameable = 0, lost_nameable = 0; // of what vertices can name
    collision::ProximityStats stats;
    std::uint64_t slots = 0;
    std::size_t memory = 0;
};

/// What setups are compared with, [step] each.
struct Reference {
    std::vector<Keys> truth;    // filled by the first setup of its kind
    std::vector<Keys> nameable; // filled by kNameable
};

Result<Totals> run(Walk& walk, const Setup& setup, Reference& reference) {
    const ProximityOptions& options = setup.options;
    std::vector<Keys>& truth = reference.truth;
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
        for (const Proximity& p : found) totals.self_near += p.surface_a == p.surface_b;
        Keys keys = keys_of(found), rest;
        if (setup.name == kNameable) reference.nameable.push_back(keys);
        if (k < reference.nameable.size() && options.leaf_test == LeafTest::Vertices) {
            const Keys& nameable = reference.nameable[k];
            std::set_difference(nameable.begin(), nameable.end(), keys.begin(), keys.end(), std::back_inserter(rest));
            totals.nameable += nameable.size();
            totals.lost_nameable += rest.size();
            rest.clear();
        }
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
    row["scene"] = kSceneNames[static_cast<std::size_t>(setup.scene)];
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
    if (totals.nameable > 0) { // of a method of vertices: most of what it loses it has no name for
        row["nameable_percent"] = true_ones > 0 ? 100.0 * static_cast<double>(totals.nameable) / static_cast<double>(true_ones) : 0.0;
        row["lost_of_nameable_percent"] = 100.0 * static_cast<double>(totals.lost_nameable) / static_cast<double>(totals.nameable);
    }
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
    const std::size_t steps = options.quick ? 3 : 600;
    Walk walking(steps, true), standing(steps, false);
    std::array<Reference, std::size(kSceneNames)> references;
    for (const Setup& setup : make_setups()) {
        options.progress(fmt::format("{}: {}", kSceneNames[static_cast<std::size_t>(setup.scene)], setup.name));
        Reference& reference = references[static_cast<std::size_t>(setup.scene)];
        const auto totals = run(setup.scene == FigureScene::Standing ? standing : walking, setup, reference);
        if (!totals) return totals.error();
        table.rows.push_back(make_row(setup, *totals, reference.truth));
    }
    table.notes.push_back(
        fmt::format("{} steps of {} s, d_close {} m, processor time of one thread; figure of {} faces, cloth of {}; paper_* are "
                    "the paper's seconds for its 600 steps, on a machine of 2003",
                    steps, WalkingFigure::kStep, kClose, walking.figure().triangles.size(), walking.cloth().triangles.size()));
    table.notes.push_back("lost counts pairs of faces. A method of vertices against faces has names for nameable_percent of them alone, those of which a "
                          "vertex comes near the other face: lost_of_nameable_percent is what it loses of these");
    for (const char* sentence : kWhereShapesDiffer) table.notes.emplace_back(sentence);
    for (const collision::PolicyLabel& label : collision::kPolicyLabels)
        table.notes.push_back(
            fmt::format("{} {}: {}", label.policy, label.exactness == Exactness::Exact ? "is exact" : "is a heuristic", label.why));
    return table;
}

} // namespace trocar::engine
