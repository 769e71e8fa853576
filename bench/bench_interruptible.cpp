// Table 1 of Mendoza & O'Sullivan 2005: two bodies that penetrate each other, the descent interrupted after a given amount of work or time.
// Beside its list lengths stands what the paper did not show: the share of the surface wrongly reported as touching.
#include "base/inside.hpp"
#include "base/self_intersection.hpp"
#include "bench/solid_bodies.hpp"
#include "bench/tables.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/report/statistics.hpp"
#include "engine/scene/settings.hpp"
#include "engine/time/step_budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

using spheretree::DescentOrder;

/// A row of the paper's table: list lengths and frame rates of dragons, bunnies, bunny and dragon.
struct PaperRow {
    double critical_s;
    std::uint64_t open[3], leaves[3], fps[3];
};
constexpr PaperRow kPaper[] = {{0.0001, {3, 3, 3}, {0, 0, 0}, {60, 52, 56}},
                               {0.001, {17, 25, 21}, {0, 0, 0}, {60, 48, 51}},
                               {0.01, {30, 44, 33}, {0, 0, 0}, {42, 37, 42}},
                               {0.1, {41, 61, 52}, {6, 11, 12}, {35, 30, 33}},
                               {1.0, {1345, 1405, 1387}, {30, 36, 28}, {25, 22, 23}}};
constexpr double kWallBudgetsMs[] = {0.01, 0.03, 0.1, 1.0};
constexpr int kCap = 2; // level at which the depth-capped baseline stops

/// Two bodies in one pose, and the ground truth there.
struct Encounter {
    PlacedBody a, b;
    InsideTest inside_b;
    std::vector<bool> touches; // [triangles of a] meets a triangle of b
    std::size_t touching = 0;
};

struct SubjectPair {
    std::string name;
    const SolidBody *a, *b;
    std::vector<Encounter> encounters;
};

Encounter meet(const SolidBody& a, const SolidBody& b, const Pose& pose) {
    Encounter met{place(a, {}), place(b, pose), {}, {}, 0};
    met.inside_b = InsideTest(met.b.mesh);
    met.touches.assign(met.a.mesh.triangles.size(), false);
    const auto corners = [](const TriMesh& mesh, Index t) {
        const Triangle& c = mesh.triangles[t];
        return std::array<Vec3, 3>{mesh.vertices[c[0]], mesh.vertices[c[1]], mesh.vertices[c[2]]};
    };
    for (Index t = 0; t < met.touches.size(); ++t) {
        const auto own = corners(met.a.mesh, t);
        Box3 box;
        for (const Vec3& p : own) box.add(p);
        met.inside_b.tree().for_each_overlapping(box, [&](Index other) {
            if (!met.touches[t] && triangles_cross(own, corners(met.b.mesh, other), Crossing::Touching)) met.touches[t] = true;
        });
        met.touching += met.touches[t];
    }
    return met;
}

/// From a first touch to deep inside, turning on the way.
SubjectPair make_subject(const std::string& name, const SolidBody& a, const SolidBody& b, int poses) {
    SubjectPair subject{name, &a, &b, {}};
    const double reach = 0.5 * (a.mesh.bounds().extent().x() + b.mesh.bounds().extent().x());
    for (int k = 0; k < poses; ++k) {
        const double way = static_cast<double>(k) / static_cast<double>(std::max(1, poses - 1));
        subject.encounters.push_back(meet(a, b, {0.4 + 0.5 * way, Vec3((0.8 - 0.45 * way) * reach, 0.0, 0.0)}));
    }
    return subject;
}

void start(const SubjectPair& subject, const Encounter& met, DescentOrder order, spheretree::Descent& descent) {
    descent.begin(0.0, order, kCap);
    descent.add_solid_pair({Thing::body(0), &subject.a->tree, met.a.spheres}, {Thing::body(1), &subject.b->tree, met.b.spheres});
}

/// The result of one interrupted descent against the truth.
struct Answer {
    double open = 0, leaves = 0, level = 0, us = 0;
    double flagged = 0, touching = 0, missed = 0, farthest_mm = 0;

    void add(const Answer& o) {
        open += o.open, leaves += o.leaves, level += o.level, us += o.us;
        flagged += o.flagged, touching += o.touching, missed += o.missed, farthest_mm += o.farthest_mm;
    }
    void divide(double n) {
        for (double* value : {&open, &leaves, &level, &us, &flagged, &touching, &missed, &farthest_mm}) *value /= n;
    }
};

Answer judge(const SubjectPair& subject, const Encounter& met, const spheretree::Descent& descent, double us) {
    const spheretree::DescentStats stats = descent.stats();
    std::vector<Contact> contacts;
    descent.add_contacts(contacts);
    std::vector<bool> flagged(met.touches.size(), false);
    for (const Contact& c : contacts)
        for (const Index t : subject.a->tree.items_of(c.feature_a[0])) flagged[t] = true;
    Answer answer;
    answer.open = static_cast<double>(stats.pairs_open);
    answer.leaves = static_cast<double>(stats.leaf_contacts);
    answer.level = stats.level_reached;
    answer.us = us;
    answer.touching = static_cast<double>(met.touching);
    for (Index t = 0; t < flagged.size(); ++t) {
        answer.flagged += flagged[t];
        answer.missed += met.touches[t] && !flagged[t];
        if (!flagged[t] || met.touches[t]) continue;
        const Triangle& c = met.a.mesh.triangles[t];
        const Vec3 middle = (met.a.mesh.vertices[c[0]] + met.a.mesh.vertices[c[1]] + met.a.mesh.vertices[c[2]]) / 3.0;
        answer.farthest_mm = std::max(answer.farthest_mm, 1e3 * met.inside_b.signed_distance(middle));
    }
    return answer;
}

/// Smallest budget that leaves at least `open` pairs, in this pose; where none does, the one that leaves most.
std::uint64_t find_work(const SubjectPair& subject, const Encounter& met, std::uint64_t open) {
    spheretree::Descent descent;
    start(subject, met, DescentOrder::Breadth, descent);
    std::uint64_t work = 0, most = 0, best = 0;
    for (bool finished = false; !finished;) {
        WorkBudget one(1);
        finished = descent.run(one);
        ++work;
        const std::uint64_t left = descent.open_pairs();
        if (left >= open) return work;
        if (left > most) most = left, best = work;
    }
    return best;
}

std::uint64_t median_count(std::vector<std::uint64_t> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

Answer run_work(const SubjectPair& subject, DescentOrder order, std::uint64_t work) {
    constexpr int kRepeats = 20; // of the timed part, which is microseconds
    spheretree::Descent descent;
    Answer sum;
    for (const Encounter& met : subject.encounters) {
        const std::int64_t before = thread_cpu_ns();
        for (int k = 0; k < kRepeats; ++k) {
            start(subject, met, order, descent);
            WorkBudget budget(work);
            descent.run(budget);
        }
        sum.add(judge(subject, met, descent, 1e-3 * static_cast<double>(thread_cpu_ns() - before) / kRepeats));
    }
    sum.divide(static_cast<double>(subject.encounters.size()));
    return sum;
}

/// Under a deadline, as the engine keeps it; over_us gets what every descent took beyond its budget.
Answer run_wall(const SubjectPair& subject, double budget_ms, std::vector<double>& over_us) {
    const MonotonicClock clock;
    StepBudget budget(clock, {BudgetMode::Wall, 1e-3 * budget_ms, 0});
    spheretree::Descent descent;
    Answer sum;
    for (int round = 0; round < 10; ++round)
        for (const Encounter& met : subject.encounters) {
            budget.begin();
            start(subject, met, DescentOrder::Breadth, descent);
            for (bool finished = false; !finished;) {
                WorkBudget grant = budget.grant_descent(descent.next_cost());
                if (grant.left() == 0) break;
                finished = descent.run(grant);
                budget.settle_descent(grant);
            }
            budget.pause();
            const double us = 1e6 * budget.elapsed_s();
            over_us.push_back(std::max(0.0, us - 1e3 * budget_ms));
            if (round == 9) sum.add(judge(subject, met, descent, us));
        }
    sum.divide(static_cast<double>(subject.encounters.size()));
    return sum;
}

BenchRow make_row(const SubjectPair& subject, const std::string& order, const std::string& budget, const Answer& a) {
    return {{"bodies", subject.name},       {"order", order},         {"budget", budget},   {"open", a.open},
            {"leaf_pairs", a.leaves},       {"level", a.level},       {"us", a.us},         {"descents_per_s", a.us > 0.0 ? 1e6 / a.us : 0.0},
            {"fps", a.us > 0.0 ? 1e6 / a.us : 0.0}, // deprecated: the name that descents_per_s had
            {"called_touching", a.flagged}, {"touching", a.touching}, {"missed", a.missed}, {"farthest_mm", a.farthest_mm}};
}

void add_work_rows(const SubjectPair& subject, std::size_t column, const BenchOptions& options, BenchTable& table) {
    constexpr std::pair<DescentOrder, const char*> kOrders[] = {{DescentOrder::Breadth, "breadth"},
                                                                {DescentOrder::Deepest, "deepest"},
                                                                {DescentOrder::Depth, "depth"},
                                                                {DescentOrder::DepthCapped, "depth, capped"}};
    for (const PaperRow& paper : kPaper) {
        std::vector<std::uint64_t> works;
        for (const Encounter& met : subject.encounters) works.push_back(find_work(subject, met, paper.open[column]));
        const std::uint64_t work = median_count(works);
        for (const auto& [order, name] : kOrders) {
            if (order != DescentOrder::Breadth && (options.quick || paper.open[column] < 30)) continue;
            BenchRow row = make_row(subject, name, fmt::format("work:{}", work), run_work(subject, order, work));
            if (order == DescentOrder::Breadth)
                row["paper"] = fmt::format("{:g} s: {} open, {} leaf pairs, {} fps", paper.critical_s, paper.open[column],
                                           paper.leaves[column], paper.fps[column]);
            table.rows.push_back(row);
        }
    }
    table.rows.push_back(make_row(subject, "breadth", "exact", run_work(subject, DescentOrder::Breadth, WorkBudget::kUnlimited)));
}

void add_wall_rows(const SubjectPair& subject, BenchTable& table) {
    for (const double ms : kWallBudgetsMs) {
        std::vector<double> over;
        BenchRow row = make_row(subject, "breadth", fmt::format("{:g}ms", ms), run_wall(subject, ms, over));
        std::sort(over.begin(), over.end());
        row["over_p99_us"] = over[over.size() * 99 / 100];
        row["over_worst_us"] = over.back();
        table.rows.push_back(row);
    }
}

/// The paper's critical times, as budgets for contact.
constexpr const char* kFrameBudgets[] = {"0.1ms", "1ms", "10ms", "100ms", "exact"};

/// Whole steps of two spiky bodies, one of which falls into the other: what a frame takes but for drawing it.
Result<void> add_frames(const BenchOptions& options, BenchTable& table) {
    const std::filesystem::path file = options.scene.empty() ? "assets/scenes/spikes.json" : options.scene;
    if (options.scene.empty() && !std::filesystem::exists(file)) {
        table.notes.push_back("whole steps: not measured; " + file.string() + " is not below this folder, and --scene names no other");
        return {};
    }
    const Result<Scene> scene = read_scene(file);
    if (!scene.ok()) return scene.error();
    options.progress("whole steps of " + scene->name);
    const auto prepared = make_prepared_scene(*scene);
    if (!prepared.ok()) return prepared.error();
    note_scene(table, *scene, prepared->model);
    for (const char* name : kFrameBudgets) {
        Simulator simulator(prepared->model, parse_budget(name)->limits);
        std::vector<double> whole, charged;
        double open = 0.0, leaves = 0.0;
        const std::uint64_t steps = std::min<std::uint64_t>(options.quick ? 6 : 80, prepared->model.step_count);
        for (std::uint64_t k = 0; k < steps; ++k) {
            const StepReport& report = simulator.step();
            if (!report.finite) return Error{ErrorCode::BadValue, scene->name + ": " + report.failure};
            whole.push_back(report.ms.total);
            charged.push_back(report.ms.budget);
            open += static_cast<double>(report.pairs_open);
            leaves += static_cast<double>(report.leaf_contacts);
        }
        const Percentiles total = find_percentiles(whole), contact = find_percentiles(charged);
        table.rows.push_back({{"bodies", "spikes.json, whole steps"},
                              {"order", "breadth"},
                              {"budget", name},
                              {"open", open / static_cast<double>(steps)},
                              {"leaf_pairs", leaves / static_cast<double>(steps)},
                              {"steps_per_s", total.p50 > 0.0 ? 1e3 / total.p50 : 0.0},
                              {"step_ms_p50", total.p50},
                              {"charged_ms_p50", contact.p50}});
    }
    return {};
}

} // namespace

Result<BenchTable> bench_interruptible(const BenchOptions& options) {
    BenchTable table;
    const Result<std::vector<SolidBody>> bodies = make_dragon_and_bunny(options);
    if (!bodies) return bodies.error();
    const SolidBody &first = bodies->front(), &second = bodies->back();
    const int poses = options.quick ? 3 : 12;
    const auto twice = [](const SolidBody& body) { return "two of " + body.name; };
    for (const auto& [a, b, name, column] : {std::tuple{&first, &first, twice(first), 0}, std::tuple{&second, &second, twice(second), 1},
                                             std::tuple{&second, &first, second.name + " and " + first.name, 2}}) {
        options.progress(name);
        const SubjectPair subject = make_subject(name, *a, *b, poses);
        add_work_rows(subject, static_cast<std::size_t>(column), options, table);
        add_wall_rows(subject, table);
    }
    if (const Result<void> framed = add_frames(options, table); !framed) return framed.error();
    for (const SolidBody& body : *bodies)
        table.notes.push_back(fmt::format("{}: {} triangles, {} spheres on levels 0 to {} ({} builder)", body.name,
                                          body.mesh.triangles.size(), body.tree.sphere_count(), body.tree.leaf_depth(), body.builder));
    table.notes.push_back(
        fmt::format("means over {} poses from a first touch to deep inside; called_touching, touching, missed: triangles of the first "
                    "body; farthest_mm: of those called touching, the one farthest outside the other body; a medial sphere may hold "
                    "triangles on far sides of the body",
                    poses));
    table.notes.push_back(
        "the paper's critical times are a Pentium 4's: work budgets are chosen so that as many pairs stay open as in its rows, wall "
        "budgets stand beside; its last row (1 s at 25 fps) contradicts itself");
    table.notes.push_back("descents_per_s (until the next version also as fps, which it is not): 1 / us, the interrupted descent alone; steps_per_s: "
                          "whole steps, tissue, contact and response, of which nothing is drawn; the paper's frames are drawn");
    table.notes.push_back("missed must be 0 for breadth and deepest; depth, capped at level 2, calls its spheres there contacts and misses "
                          "nothing either, but is finished "
                          "on one side and coarsest on the other when interrupted");
    return table;
}

} // namespace trocar::engine
