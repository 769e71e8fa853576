// Private to bench: one row of figures for each way to cull a scene of Govindaraju et al. 2005.
#pragma once

#include "collision/search/contact_search.hpp"
#include "collision/culling/cull_twin.hpp"
#include "bench/chromatic_scenes.hpp"
#include "bench/tables.hpp"
#include "bench/volume_hierarchy.hpp"
#include "engine/render/culled_search.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

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

class ChromaticTable {
public:
    ChromaticTable(BenchTable& table, const BenchOptions& options) : table_(table), options_(options) {}

    void start(const CullScene& scene) {
        scene_ = &scene;
        box_tree_ms_ = 0.0;
    }

    /// One volume around each triangle, every pair that overlaps tested feature by feature: the baseline of Govindaraju et al. 2005.
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
        collision::ContactSearch search;
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
        collision::ContactSearch search;
        build(search);
        Medians medians;
        std::vector<collision::SearchContact> found;
        std::size_t with_two = 0;
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
            with_two += culled.looked();
        }
        const double total = medians.sum({"refit_ms", "near_ms", "look_ms", "collect_ms", "tests_ms"});
        BenchRow& row = end(method, medians, total);
        row["share_I"] = total > 0.0 ? medians.sum({"refit_ms", "near_ms"}) / total : 0.0;
        row["share_II"] = total > 0.0 ? medians.of("look_ms") / total : 0.0;
        row["share_tests"] = total > 0.0 ? medians.of("tests_ms") / total : 0.0;
        row["steps"] = scene_->step_count();
        row["steps_with_II"] = with_two;
        row["times_fewer_by_II"] = medians.of("pcs_after_II") > 0.0 ? medians.of("pcs_after_I") / medians.of("pcs_after_II") : 0.0;
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
            const collision::SurfaceMotion motion = scene_->motions(k).front();
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

    void build(collision::ContactSearch& search) const {
        const auto topologies = scene_->topologies();
        const std::vector<std::span<const Vec3>> positions(topologies.size(), scene_->frames.frame(0));
        collision::SearchOptions options;
        options.within = scene_->within;
        options.between = scene_->between;
        search.build(topologies, positions, options);
    }

    static void test(const collision::SurfaceMotion& a, const collision::SurfaceMotion& b, const PairFeatures& features,
                     std::vector<collision::Sweep>& sweeps) {
        sweeps.resize(std::max({features.vertex_face.size(), features.face_vertex.size(), features.edge_edge.size()}));
        sweep_vertex_faces(a, b, features.vertex_face, {}, std::span(sweeps).first(features.vertex_face.size()));
        sweep_vertex_faces(b, a, features.face_vertex, {}, std::span(sweeps).first(features.face_vertex.size()));
        sweep_edge_edges(a, b, features.edge_edge, {}, std::span(sweeps).first(features.edge_edge.size()));
    }

    static void note_found(const collision::ContactSearch& search, Medians& medians) {
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

} // namespace trocar::engine
