// Set-based culling on the scenes of its paper: what each stage costs and leaves, beside AABB and sphere hierarchies and the paper's
// figures.
#include "collision/contact_search.hpp"
#include "collision/cull_twin.hpp"
#include "engine/bench/chromatic_scenes.hpp"
#include "engine/bench/tables.hpp"
#include "engine/bench/volume_hierarchy.hpp"
#include "engine/gpu/culled_search.hpp"
#include "engine/gpu/gl_cull_backend.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace seldinger::engine {

namespace {

using collision::ContactSearch;
using collision::CullMemory;
using collision::SurfaceMotion;

/// Medians over the steps, by name.
class Medians {
public:
    void add(const std::string& name, double value) {
        for (auto& [known, values] : columns_)
            if (known == name) {
                values.push_back(value);
                return;
            }
        columns_.push_back({name, {value}});
    }
    [[nodiscard]] double of(const std::string& name) const {
        for (const auto& [known, values] : columns_)
            if (known == name) {
                std::vector<double> sorted = values;
                std::sort(sorted.begin(), sorted.end());
                return sorted[sorted.size() / 2];
            }
        return 0.0;
    }
    [[nodiscard]] double sum(std::initializer_list<const char*> names) const {
        double total = 0.0;
        for (const char* name : names) total += of(name);
        return total;
    }
    void write(BenchRow& row) const {
        for (const auto& [name, values] : columns_) row[name] = of(name);
    }

private:
    std::vector<std::pair<std::string, std::vector<double>>> columns_;
};

class Table {
public:
    Table(BenchTable& table, const BenchOptions& options) : table_(table), options_(options) {}

    void start(const CullScene& scene) {
        scene_ = &scene;
        box_tree_ms_ = 0.0;
    }

    /// One volume around each triangle, every pair that overlaps tested feature by feature: what the paper compares with.
    void add_volumes(const char* method, VolumeKind kind) {
        options_.progress(fmt::format("{}: {}", scene_->name, method));
        std::vector<VolumeHierarchy> trees;
        for (const auto& surface : scene_->surfaces) trees.emplace_back(kind, surface, scene_->frames.frame(0));
        Medians medians;
        std::vector<collision::TrianglePair> pairs;
        PairFeatures features;
        std::vector<collision::Sweep> sweeps;
        for (std::size_t k = 0; k < scene_->step_count(); ++k) {
            const auto motions = scene_->motions(k);
            StopWatch watch;
            for (std::size_t i = 0; i < trees.size(); ++i) trees[i].refit(motions[i], 0.0);
            medians.add("refit_ms", watch.lap_ms());
            double near_ms = 0.0, tests_ms = 0.0, tests = 0.0, triangle_pairs = 0.0;
            for_each_job([&](std::size_t a, std::size_t b) {
                watch = StopWatch();
                a == b ? trees[a].find_pairs(pairs) : trees[a].find_pairs(trees[b], pairs);
                near_ms += watch.lap_ms();
                list_features(*motions[a].topology, *motions[b].topology, pairs, features);
                test(motions[a], motions[b], features, sweeps);
                tests_ms += watch.lap_ms();
                tests += static_cast<double>(features.size());
                triangle_pairs += static_cast<double>(pairs.size());
            });
            medians.add("near_ms", near_ms);
            medians.add("tests_ms", tests_ms);
            medians.add("tests", tests);
            medians.add("pairs_after_I", triangle_pairs);
        }
        const double total = medians.sum({"refit_ms", "near_ms", "tests_ms"});
        if (kind == VolumeKind::Box) box_tree_ms_ = total;
        end(method, medians, total);
    }

    /// This library's hierarchy.
    void add_hierarchy() {
        options_.progress(fmt::format("{}: hierarchy", scene_->name));
        ContactSearch search;
        build(search);
        Medians medians;
        std::vector<collision::SearchContact> found;
        for (std::size_t k = 0; k < scene_->step_count(); ++k) {
            const auto motions = scene_->motions(k);
            StopWatch watch;
            search.refit(motions);
            medians.add("refit_ms", watch.lap_ms());
            search.find_candidates();
            medians.add("near_ms", watch.lap_ms());
            search.decide(found);
            medians.add("tests_ms", watch.lap_ms());
            note_found(search, medians);
        }
        end("this library's hierarchy", medians, medians.sum({"refit_ms", "near_ms", "tests_ms"}));
    }

    /// returns   ms of stage II
    double add_sets(const std::string& method, CulledSearch::Options options) {
        options_.progress(fmt::format("{}: {}", scene_->name, method));
        options.within = scene_->within;
        options.between = scene_->between;
        const auto topologies = scene_->topologies();
        const std::vector<std::span<const Vec3>> positions(topologies.size(), scene_->frames.frame(0));
        StopWatch preparing;
        CulledSearch culled(topologies, positions, options);
        const double prepare_ms = preparing.lap_ms();
        ContactSearch search;
        build(search);
        Medians medians;
        std::vector<collision::SearchContact> found;
        for (std::size_t k = 0; k < scene_->step_count(); ++k) {
            const auto motions = scene_->motions(k);
            const CullTimes times = culled.find_candidates(motions);
            search.start_given(motions);
            for (const auto& job : culled.jobs())
                search.give_candidates(job.a, job.b, job.candidates.vertex_face, job.candidates.face_vertex, job.candidates.edge_edge);
            StopWatch watch;
            search.decide(found);
            const double tests_ms = watch.lap_ms();
            culled.note_tests(tests_ms);
            medians.add("refit_ms", times.refit_ms);
            medians.add("near_ms", times.near_ms);
            medians.add("look_ms", times.look_ms);
            medians.add("collect_ms", times.collect_ms);
            medians.add("tests_ms", tests_ms);
            note_found(search, medians);
            note_culled(culled, medians);
        }
        const double total = medians.sum({"refit_ms", "near_ms", "look_ms", "collect_ms", "tests_ms"});
        BenchRow& row = end(method, medians, total);
        row["share_I"] = total > 0.0 ? medians.sum({"refit_ms", "near_ms"}) / total : 0.0;
        row["share_II"] = total > 0.0 ? medians.of("look_ms") / total : 0.0;
        row["share_tests"] = total > 0.0 ? medians.of("tests_ms") / total : 0.0;
        row["colours"] = culled.colours();
        row["prepare_ms"] = prepare_ms;
        row["culler"] = culled.backend();
        if (options.contexts.order.empty()) return medians.of("look_ms"); // the CPU was wanted
        for (const std::string& note : culled.notes())
            if (std::find(table_.notes.begin(), table_.notes.end(), note) == table_.notes.end()) table_.notes.push_back(note);
        return medians.of("look_ms");
    }

    /// Stage II alone, every set cut into parts: time against the number of sets.
    void add_parts(Index parts) {
        options_.progress(fmt::format("{}: sets in {} parts", scene_->name, parts));
        const auto& surface = scene_->surfaces.front();
        collision::BoxTree tree;
        tree.build(surface, scene_->frames.frame(0));
        collision::ChromaticCuller culler(surface);
        std::vector<Index> set_of = culler.sets().set_of;
        for (Index t = 0; t < set_of.size(); ++t) set_of[t] = set_of[t] * parts + (t / 7) % parts;
        collision::CpuCullBackend twin;
        collision::SetCuller sets;
        Medians medians;
        for (std::size_t k = 0; k < scene_->step_count(); ++k) {
            const SurfaceMotion motion = scene_->motions(k).front();
            tree.refit(motion);
            culler.find_near(motion, tree, motion, tree, 0.0, 0.0);
            std::vector<collision::TrianglePair> pairs(culler.pairs().begin(), culler.pairs().end());
            std::vector<collision::SweptCorners> prisms;
            for (const Triangle& t : surface.triangles)
                prisms.push_back({motion.t0[t[0]], motion.t0[t[1]], motion.t0[t[2]], motion.t1[t[0]], motion.t1[t[1]], motion.t1[t[2]]});
            const double reach = collision::reach_of_contact(0.0, 0.0, 10.0);
            medians.add("pairs_after_I", static_cast<double>(pairs.size()));
            StopWatch watch;
            const auto report =
                sets.cull({prisms, surface.triangles, set_of, culler.set_count() * parts, reach}, {.max_rounds = 1}, twin, pairs);
            medians.add("look_ms", watch.lap_ms());
            medians.add("pairs_after_II", static_cast<double>(pairs.size()));
            if (report.ok()) medians.add("questions", static_cast<double>(report->questions));
        }
        BenchRow& row = end(fmt::format("II alone, one round, each set in {}", parts), medians, medians.of("look_ms"));
        row["colours"] = culler.set_count() * parts;
    }

private:
    template <class Visit>
    void for_each_job(Visit&& visit) const {
        for (std::size_t a = 0; a < scene_->surfaces.size(); ++a)
            for (std::size_t b = a; b < scene_->surfaces.size(); ++b)
                if (a == b ? scene_->within : scene_->between) visit(a, b);
    }

    void build(ContactSearch& search) const {
        const auto topologies = scene_->topologies();
        const std::vector<std::span<const Vec3>> positions(topologies.size(), scene_->frames.frame(0));
        collision::SearchOptions options;
        options.within = scene_->within;
        options.between = scene_->between;
        search.build(topologies, positions, options);
    }

    static void test(const SurfaceMotion& a, const SurfaceMotion& b, const PairFeatures& features, std::vector<collision::Sweep>& sweeps) {
        sweeps.resize(std::max({features.vertex_face.size(), features.face_vertex.size(), features.edge_edge.size()}));
        sweep_vertex_faces(a, b, features.vertex_face, {}, std::span(sweeps).first(features.vertex_face.size()));
        sweep_vertex_faces(b, a, features.face_vertex, {}, std::span(sweeps).first(features.face_vertex.size()));
        sweep_edge_edges(a, b, features.edge_edge, {}, std::span(sweeps).first(features.edge_edge.size()));
    }

    static void note_found(const ContactSearch& search, Medians& medians) {
        medians.add("tests", static_cast<double>(search.stats().candidates_vf + search.stats().candidates_ee));
        medians.add("hits", static_cast<double>(search.stats().hits_vf + search.stats().hits_ee));
    }

    static void note_culled(const CulledSearch& culled, Medians& medians) {
        double near = 0.0, left = 0.0, near_pairs = 0.0, left_pairs = 0.0, questions = 0.0;
        for (const auto& job : culled.jobs()) {
            const collision::CullCounts& counts = job.culler->counts();
            near += static_cast<double>(counts.near_triangles);
            left += static_cast<double>(counts.left_triangles);
            near_pairs += static_cast<double>(counts.near_pairs);
            left_pairs += static_cast<double>(counts.left_pairs);
            questions += static_cast<double>(counts.pictures.questions + counts.queries.queries);
        }
        medians.add("pcs_after_I", near);
        medians.add("pcs_after_II", left);
        medians.add("pairs_after_I", near_pairs);
        medians.add("pairs_after_II", left_pairs);
        medians.add("questions", questions);
    }

    BenchRow& end(const std::string& method, const Medians& medians, double total) {
        BenchRow row{{"scene", scene_->name},
                     {"triangles", scene_->triangle_count()},
                     {"looked_for", !scene_->between ? "self"
                                    : scene_->within ? "self and other"
                                                     : "other"},
                     {"method", method}};
        medians.write(row);
        row["total_ms"] = total;
        row["times_faster_than_aabb"] = total > 0.0 && box_tree_ms_ > 0.0 ? box_tree_ms_ / total : 0.0;
        row["paper_ms"] = scene_->paper_ms;
        row["paper_sets"] = scene_->paper_sets;
        table_.rows.push_back(std::move(row));
        return table_.rows.back();
    }

    BenchTable& table_;
    const BenchOptions& options_;
    const CullScene* scene_ = nullptr;
    double box_tree_ms_ = 0.0;
};

void compare_methods(Table& table, const CullScene& scene, bool all) {
    table.start(scene);
    table.add_volumes("AABB tree, pair by pair", VolumeKind::Box);
    table.add_volumes("sphere tree, pair by pair", VolumeKind::Sphere);
    table.add_hierarchy();
    table.add_sets("sets, without II", {.method = CullMethod::None});
    table.add_sets("sets, II with intervals", {.method = CullMethod::Cpu});
    table.add_sets("sets, II with fronts", {.method = CullMethod::Cpu, .plan = {.memory = CullMemory::Fronts}});
    table.add_sets("sets, II where it pays", {.method = CullMethod::Auto});
    if (!all) return;
    table.add_sets("sets, II with fronts, reversed views too",
                   {.method = CullMethod::Cpu, .plan = {.memory = CullMemory::Fronts, .reversed_views = true}});
    table.add_sets("sets, II with intervals in one round", {.method = CullMethod::Cpu, .plan = {.max_rounds = 1}});
}

/// The paper's queries, each saving of queries by itself and all together.
void compare_coherence(Table& table, const CullScene& scene, int resolution) {
    table.start(scene);
    ContextOptions nowhere; // by the CPU: the counts are the same, and the times those of one machine
    nowhere.order.clear();
    const collision::QueryPlan bare{
        .resolution = resolution, .max_rounds = 2, .axis_tests = false, .view_coherence = false, .temporal_order = false};
    const auto add = [&](const char* name, bool axes, bool views, bool order) {
        collision::QueryPlan plan = bare;
        plan.axis_tests = axes;
        plan.view_coherence = views;
        plan.temporal_order = order;
        table.add_sets(name, {.method = CullMethod::Query, .queries = plan, .contexts = nowhere});
    };
    add("queries, no coherence", false, false, false);
    add("queries, 1D tests", true, false, false);
    add("queries, view coherence", false, true, false);
    add("queries, view coherence and temporal order", false, true, true);
    add("queries, all", true, true, true);
}

/// The same pictures by OpenGL and by the CPU twin, over sizes: from which one on is a device worth its way?
/// software   few sizes then, for it never is
void compare_with_device(Table& table, BenchTable& result, const std::string& name, bool software, std::size_t steps) {
    std::size_t from = 0, largest = 0;
    for (const std::size_t side : software ? std::vector<std::size_t>{16, 33} : std::vector<std::size_t>{16, 33, 57, 81, 107, 160}) {
        const CullScene cloth = make_cloth_scene(fmt::format("cloth {:.1f}K", 2e-3 * static_cast<double>(side * side)), side, side, steps);
        const collision::CullPlan plan{.resolution = software ? 128 : 0, .max_rounds = 1};
        table.start(cloth);
        const double twin_ms = table.add_sets("II by the CPU twin, as large as OpenGL's", {.method = CullMethod::Cpu, .plan = plan});
        const double device_ms = table.add_sets("II by OpenGL", {.method = CullMethod::Gl, .plan = plan});
        largest = cloth.triangle_count();
        if (device_ms >= twin_ms)
            from = 0;
        else if (from == 0)
            from = largest;
    }
    result.notes.push_back(from == 0 ? fmt::format("stage II by {}: slower than the CPU twin up to {} triangles, the largest measured{}",
                                                   name, largest, software ? "; it is drawn by software" : "")
                                     : fmt::format("stage II by {}: faster than the CPU twin from {} triangles on", name, from));
}

} // namespace

Result<BenchTable> bench_chromatic(const BenchOptions& options) {
    BenchTable result;
    Table table(result, options);
    const auto gl = GlCullBackend::make();
    const bool hardware = gl.ok() && !(*gl)->is_software();
    result.notes.push_back(gl.ok() ? fmt::format("OpenGL: {}", (*gl)->name()) : "no OpenGL: " + gl.error().message);
    if (gl.ok() && !hardware)
        result.notes.push_back("OpenGL is drawn by software here: its rows are for the answers, and on the smallest scenes alone; "
                               "a graphics card was not measured");
    const std::size_t steps = options.quick ? 1 : 5;

    CullScene skirt = options.quick ? make_cloth_scene("skirt 3K", 40, 40, steps) : make_cloth_scene("skirt 13K", 81, 80, steps);
    skirt.paper_ms = "400-500";
    compare_methods(table, skirt, true);
    const CullScene small = make_cloth_scene("cloth 2K", 33, 32, options.quick ? 2 : 5);
    compare_coherence(table, small, 128);
    if (gl.ok()) {
        compare_with_device(table, result, (*gl)->name(), !hardware, options.quick ? 1 : 2);
        table.start(hardware ? skirt : small);
        table.add_sets("queries by OpenGL, all",
                       {.method = CullMethod::Query, .queries = {.resolution = hardware ? 0 : 128, .max_rounds = 2}});
    }
    table.start(skirt);
    for (const Index parts : {1u, 2u, 4u}) table.add_parts(parts);
    if (!options.quick) {
        for (const std::size_t side : {40, 57, 127}) { // with those before and after: shares by model size, the paper's figure 9a
            const CullScene cloth =
                make_cloth_scene(fmt::format("cloth {:.0f}K", 2e-3 * static_cast<double>(side * side)), side, side, steps);
            table.start(cloth);
            table.add_sets("sets, II with intervals", {.method = CullMethod::Cpu});
        }
        CullScene cloth = make_cloth_scene("cloth 23K", 107, 107, steps);
        cloth.paper_ms = "400-550";
        cloth.paper_sets = "19";
        compare_methods(table, cloth, false);
        CullScene curtains = make_curtains_scene(127, 128, steps);
        curtains.paper_ms = "2 x 100";
        curtains.paper_sets = "10";
        compare_methods(table, curtains, false);
        curtains.within = false;
        curtains.between = true;
        curtains.paper_ms = curtains.paper_sets = "";
        compare_methods(table, curtains, false); // cloth against an object: the paper has self-contact cost 3 to 5 times as much
        compare_methods(table, make_catheter_scene(steps), true);
        compare_methods(table, make_catheter_alone_scene(steps), false);
    }
    result.notes.push_back(
        "paper: cloth of 12,296 triangles: 6,442 left after I, 524 after II, 65K elementary tests without II and 2,737 with "
        "it; I 40-50 % of the time, II 35-45 %, tests below 10 %; 5 times faster than AABB trees without II, 15-20 times "
        "with it; self-contact 3 to 5 times cloth against object; 100-150 ms at 10 sets, 300-550 at 20");
    result.notes.push_back("tests are exact verdicts, where the paper's are interval arithmetic; trees tested pair by pair count a pair of "
                           "features as often as pairs of triangles hold it, as those that the paper compares with");
    return result;
}

} // namespace seldinger::engine
