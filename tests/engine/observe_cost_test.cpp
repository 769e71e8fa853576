// The price of accuracy: distances of surfaces, contacts as patches, budgets along the exact run's states.
#include "engine/state/state_bytes.hpp"
#include "engine/experiments/cost_page.hpp"
#include "engine/experiments/patches.hpp"
#include "engine/report/gnuplot.hpp"
#include "engine/prepare/process.hpp"
#include "step_fixture.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

/// A soft ball is pressed on a table by its weight: it touches after some 10 steps.
const std::string kBallOnTable = R"({
    "name": "ball-on-table",
    "units": {"length": "mm", "pressure": "kPa"},
    "time": {"step": 0.005, "duration": 1},
    "gravity": [0, 0, -9810],
    "bodies": {
        "ball": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, 32], "radius": 30, "subdivisions": 3},
            "material": {"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.01, "mass_damping": 1},
            "coarse": {"mesher": "tetgen", "surface_triangles": 160}},
        "table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -5], "extent": [200, 200, 10], "cells": 16}}
    },
    "contact": {"solid_stiffness": 1},
    "cost": {"patch": 12, "tolerance": 0.3},
    "effects": ["elasticity", "gravity", "damping", "coarse_contact"]
})";

TriMesh tent() {
    TriMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    return mesh;
}

/// Every vertex against every triangle, both ways: root mean square, and the largest.
std::pair<double, double> distance_by_brute_force(const TriMesh& mesh, const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double largest = 0.0, sum_sq = 0.0;
    for (const auto& [from, to] : {std::pair{&a, &b}, std::pair{&b, &a}})
        for (const Vec3& p : *from) {
            double nearest = std::numeric_limits<double>::infinity();
            for (const Triangle& t : mesh.triangles)
                nearest = std::min(nearest, std::sqrt(closest_on_triangle(p, (*to)[t[0]], (*to)[t[1]], (*to)[t[2]]).distance_sq));
            largest = std::max(largest, nearest);
            sum_sq += nearest * nearest;
        }
    return {std::sqrt(sum_sq / static_cast<double>(2 * a.size())), largest};
}

/// Numbers from -0.5 to 0.5.
struct Random {
    std::uint64_t seed;
    double operator()() {
        seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
        return static_cast<double>(seed >> 40) / static_cast<double>(1 << 24) - 0.5;
    }
    Vec3 vector() { return {(*this)(), (*this)(), (*this)()}; }
};

/// A square of side 1 in its plane, cut into 2 n^2 triangles.
TriMesh sheet(Index n) {
    TriMesh mesh;
    for (Index j = 0; j <= n; ++j)
        for (Index i = 0; i <= n; ++i) mesh.vertices.emplace_back(i / static_cast<double>(n), j / static_cast<double>(n), 0.0);
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < n; ++i) {
            const Index v = j * (n + 1) + i;
            mesh.triangles.push_back({v, v + 1, v + n + 2});
            mesh.triangles.push_back({v, v + n + 2, v + n + 1});
        }
    return mesh;
}

TEST(SurfaceDistance, OfASurfaceToItselfIsNothing) {
    const TriMesh mesh = tent();
    const SurfaceDistance distance = measure_distance(mesh.triangles, mesh.vertices, mesh.vertices);
    EXPECT_EQ(distance.rms(), 0.0);
    EXPECT_EQ(distance.hausdorff, 0.0);
    EXPECT_EQ(distance.vertices, 8u) << "of both";
}

TEST(SurfaceDistance, OfOneVertexThatMovedIsKnownByHand) {
    const TriMesh mesh = tent();
    std::vector<Vec3> moved = mesh.vertices;
    moved[3].z() = 3.0;
    const SurfaceDistance distance = measure_distance(mesh.triangles, mesh.vertices, moved);
    EXPECT_DOUBLE_EQ(distance.rms(), std::sqrt(4.0 / 8.0)) << "2 m at one of eight vertices: the other way the tip lies on an edge";
    EXPECT_DOUBLE_EQ(distance.hausdorff, 2.0) << "from the far tip back to the near one";
}

TEST(SurfaceDistance, IsThatOfEveryVertexAgainstEveryTriangle) {
    const PreparedScene prepared = test::prepare(kBallOnTable);
    const TriMesh& ball = prepared.model.bodies.front().surface;
    Random random{12345};
    for (const double size : {1e-6, 1e-3, 0.05}) {
        std::vector<Vec3> moved = ball.vertices;
        for (Vec3& v : moved) v += size * random.vector() + Vec3(2.0 * size, 0.0, 0.0);
        const SurfaceDistance distance = measure_distance(ball.triangles, ball.vertices, moved);
        const auto [rms, largest] = distance_by_brute_force(ball, ball.vertices, moved);
        EXPECT_NEAR(distance.hausdorff, largest, 1e-12) << "seed 12345, size " << size;
        EXPECT_NEAR(distance.rms(), rms, 1e-12) << "seed 12345, size " << size;
    }
}

TEST(SurfaceDistance, OfASheetWhoseVerticesSlideWithinItIsNothing) {
    const TriMesh flat = sheet(8);
    std::vector<Vec3> slid = flat.vertices;
    Random random{99};
    for (Vec3& v : slid)
        if (v.x() > 0.0 && v.x() < 1.0 && v.y() > 0.0 && v.y() < 1.0) v += 0.05 * Vec3(random(), random(), 0.0);
    const SurfaceDistance distance = measure_distance(flat.triangles, flat.vertices, slid);
    EXPECT_LT(distance.rms(), 1e-12) << "the sheet is where it was";
    EXPECT_LT(distance.hausdorff, 1e-12);
}

TEST(SurfaceDistance, RootMeanSquareNeverExceedsHausdorffAndDoesNotAskWhichSurfaceComesFirst) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        SCOPED_TRACE(seed);
        Random random{seed};
        const TriMesh mesh = seed % 2 == 0 ? sheet(2 + static_cast<Index>(seed % 9)) : tent();
        const double size = std::pow(10.0, 12.0 * random() - 4.0); // 1e-10 to 1e2 of the surface's own size
        std::vector<Vec3> moved = mesh.vertices;
        const Vec3 all = seed % 3 == 0 ? Vec3(Vec3::Zero()) : Vec3(size * random.vector());
        for (Vec3& v : moved) v += all + (seed % 5 == 0 ? Vec3(Vec3::Zero()) : Vec3(size * random.vector()));
        if (seed % 7 == 0) std::fill(moved.begin(), moved.end(), mesh.vertices.front()); // all in one point
        SurfaceDistance distance = measure_distance(mesh.triangles, mesh.vertices, moved);
        EXPECT_LE(distance.rms(), distance.hausdorff);
        const SurfaceDistance back = measure_distance(mesh.triangles, moved, mesh.vertices);
        EXPECT_NEAR(back.rms(), distance.rms(), 1e-9 * distance.rms());
        EXPECT_NEAR(back.hausdorff, distance.hausdorff, 1e-9 * distance.hausdorff);
        distance.join(measure_distance(mesh.triangles, mesh.vertices, mesh.vertices));
        EXPECT_LE(distance.rms(), distance.hausdorff) << "joined with another";
    }
}

TEST(SurfaceDistance, ToWhatIsNotFiniteIsInfinite) {
    const TriMesh mesh = tent();
    std::vector<Vec3> broken = mesh.vertices;
    broken[1].x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(std::isinf(measure_distance(mesh.triangles, mesh.vertices, broken).hausdorff));
}

TEST(Patches, DifferAsTheirListsDo) {
    const PatchId a{Thing::body(0), Thing::body(1), {1, 0, 0}}, b{Thing::body(0), Thing::body(1), {2, 0, 0}}, c{Thing::body(1), Thing::body(0), {0, 0, 0}};
    const PatchContacts reference{{a, 1.0}, {b, 2.0}}, answer{{b, 2.5}, {c, 3.0}};
    const PatchDifference difference = compare_patches(reference, answer);
    EXPECT_EQ(difference.reference, 2u);
    EXPECT_EQ(difference.missed, 1u);
    EXPECT_EQ(difference.spurious, 1u);
    EXPECT_EQ(difference.compared, 3u);
    EXPECT_DOUBLE_EQ(difference.depth_error_sq, 1.0 + 0.25 + 9.0);
    EXPECT_EQ(compare_patches(reference, reference).missed + compare_patches(reference, reference).spurious, 0u);
    EXPECT_EQ(compare_patches({}, answer).spurious, 2u);
    EXPECT_EQ(compare_patches(reference, {}).missed, 2u);
}

TEST(Patches, OfABallOnATableAreWhereItTouches) {
    PreparedScene prepared = test::prepare(kBallOnTable);
    PatchFinder finder(prepared.model, {12e-3, 0.3e-3});
    State state = make_initial_state(prepared.model);
    EXPECT_TRUE(finder.find_near(state).empty()) << "2 mm above";
    for (Vec3& v : state.bodies[0].surface) v.z() -= 2.5e-3;
    const PatchContacts near = finder.find_near(state);
    ASSERT_FALSE(near.empty());
    double deepest = 0.0;
    for (const PatchContact& contact : near) deepest = std::max(deepest, contact.depth);
    EXPECT_NEAR(deepest, 0.5e-3 + 0.3e-3, 0.05e-3) << "half a millimetre in, and the tolerance";
    const auto of_body = [&](Thing body) {
        return std::count_if(near.begin(), near.end(), [&](const auto& c) { return c.patch.body == body; });
    };
    EXPECT_GT(of_body(Thing::body(0)), 0);
    EXPECT_GT(of_body(Thing::body(1)), 0);
    EXPECT_LT(of_body(Thing::body(1)), 10) << "of some 300 patches of the table";
}

TEST(Fork, AStepFromAnotherRunsStateEndsTheSame) {
    std::string wrapped = kBallOnTable; // a box: a perfect sphere's medial axis is a point, which takes long
    const std::string ball = R"("shape": "sphere", "centre": [0, 0, 32], "radius": 30, "subdivisions": 3)";
    wrapped.replace(wrapped.find(ball), ball.size(), R"("shape": "box", "centre": [0, 0, 32], "extent": [60, 60, 60], "cells": 4)");
    wrapped.replace(wrapped.find(R"("solid_stiffness": 1)"), 0, R"("sphere_trees": "wrapped", )");
    for (const std::string& text : {kBallOnTable, wrapped, test::bent_tube_scene({.host_body = test::kOrgan})}) {
        const PreparedScene prepared = test::prepare(text);
        Simulator exact(prepared.model, BudgetLimits{}), other(prepared.model, BudgetLimits{});
        for (int step = 0; step < 60; ++step) {
            ASSERT_TRUE(other.restore(exact.state()).ok());
            ASSERT_TRUE(exact.step().finite);
            ASSERT_TRUE(other.step().finite);
            ASSERT_EQ(hash_whole_state(other.state()), hash_whole_state(exact.state())) << prepared.model.name << ", step " << step;
            ASSERT_EQ(other.report().pairs_tested, exact.report().pairs_tested) << step;
            ASSERT_EQ(other.contacts().size(), exact.contacts().size()) << step;
        }
    }
}

CostTable measure(const PreparedScene& prepared, const std::vector<std::string>& budgets, std::uint64_t steps,
                  const CostSpec& cost = {12e-3, 0.3e-3}) {
    CostOptions options;
    for (const std::string& budget : budgets) options.budgets.push_back({budget, parse_budget(budget)->limits});
    options.steps = steps;
    return *measure_cost(prepared, cost, options);
}

/// Nothing in any column of errors.
bool is_all_zero(const CostRow& row) {
    return row.contacts.missed == 0 && row.contacts.spurious == 0 && row.depth_error_rms_m() == 0.0 && row.force_error_rel == 0.0 &&
           row.surface.rms() == 0.0 && row.surface.hausdorff == 0.0 && row.trajectory.rms() == 0.0 && row.trajectory.hausdorff == 0.0 &&
           row.tip_distance_max_m == 0.0 && row.pairs_open_mean == 0.0;
}

/// Root mean square never above the largest; no error of a step, all from the exact run's state, grows with the budget.
/// Surfaces are a step further where the answer stopped them: as far as they move in a step, whatever stopped them.
/// noise  of an error against that under the next smaller budget: what is open pushes by the spheres that the budget stopped at
void expect_laws(const CostTable& table, double noise) {
    constexpr double kStops = 1.3, kStopsFarthest = 1.8; // the whole body, or the places that leaves hold alone
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
        const CostRow &tight = table.rows[k], &wide = table.rows[std::min(k + 1, table.rows.size() - 1)];
        EXPECT_LE(tight.surface.rms(), tight.surface.hausdorff) << tight.name();
        EXPECT_LE(tight.trajectory.rms(), tight.trajectory.hausdorff) << tight.name();
        EXPECT_LE(wide.depth_error_rms_m(), noise * tight.depth_error_rms_m()) << tight.name() << " against " << wide.name();
        EXPECT_LE(wide.force_error_rel, noise * tight.force_error_rel) << tight.name() << " against " << wide.name();
        EXPECT_LE(wide.surface.rms(), kStops * noise * tight.surface.rms()) << tight.name() << " against " << wide.name();
        EXPECT_LE(wide.surface.hausdorff, kStopsFarthest * noise * tight.surface.hausdorff) << tight.name() << " against " << wide.name();
        EXPECT_LE(wide.contacts.spurious, tight.contacts.spurious) << tight.name() << " against " << wide.name();
        EXPECT_LE(wide.contacts.missed, tight.contacts.missed) << tight.name() << " against " << wide.name();
        EXPECT_EQ(tight.contacts.unseen, 0u) << tight.name();
    }
}

TEST(Cost, ErrorsOfAStepDoNotGrowWithTheBudgetOnTheFallingSphere) {
    if (!find_program("tetgen", "tetgen").ok()) GTEST_SKIP() << "the scene's mesher is not installed: apt-get install tetgen";
    const auto scene = read_scene(TROCAR_SOURCE_DIR "/assets/scenes/falling_sphere.json");
    ASSERT_TRUE(scene.ok());
    const auto prepared = make_prepared_scene(*scene);
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    const CostTable table = measure(*prepared, {"work:0", "work:300", "work:3000", "work:30000", "exact"}, 60, scene->cost);
    expect_laws(table, 1.1);
    EXPECT_GT(table.rows.front().depth_error_rms_m(), 0.0);
    EXPECT_GT(table.rows.front().contacts.spurious, 0u);
    EXPECT_TRUE(is_all_zero(table.rows.back()));
}

TEST(Cost, ErrorsOfAStepDoNotGrowWithTheBudgetWhereSpheresPush) {
    std::string text = kBallOnTable;
    text.replace(text.find(R"("solid_stiffness": 1)"), 0, R"("solid_response": "spheres", )");
    const CostTable table = measure(test::prepare(text), {"work:0", "work:100", "work:1000", "work:100000", "exact"}, 40);
    expect_laws(table, 1.1);
    EXPECT_GT(table.rows.front().force_error_rel, 0.0);
    EXPECT_GT(table.rows.front().surface.hausdorff, 0.0) << "tissue is a step further where the answer pushed it";
    EXPECT_LT(table.rows.front().surface.hausdorff, table.rows.front().trajectory.hausdorff) << "one step against forty";
    EXPECT_TRUE(is_all_zero(table.rows.back()));
}

TEST(Cost, SaysWhenNothingTouchedOrNothingWasLoadedAndHowManyStepsTheSceneHas) {
    std::string high = kBallOnTable;
    high.replace(high.find("[0, 0, 32]"), 10, "[0, 0, 80]");
    CostTable apart = measure(test::prepare(high), {"work:0", "exact"}, 3);
    ASSERT_EQ(apart.notices.size(), 1u);
    EXPECT_NE(apart.notices[0].find("nothing touched"), std::string::npos) << apart.notices[0];
    EXPECT_NE(apart.notices[0].find("-n 200"), std::string::npos) << apart.notices[0];
    EXPECT_NE(cost_page(*parse_scene(high, "scenes/ball.json"), apart).find("<h1>Nothing touched in 3 steps"), std::string::npos);
    const PreparedScene prepared = test::prepare(kBallOnTable);
    const CostTable near = measure(prepared, {"work:0", "exact"}, 3); // it falls 1 of the 2 mm: spheres overlap, surfaces do not
    ASSERT_EQ(near.notices.size(), 1u);
    EXPECT_NE(near.notices[0].find("nothing was loaded"), std::string::npos) << near.notices[0];
    const CostTable later = measure(prepared, {"work:0", "exact"}, 40);
    EXPECT_TRUE(later.notices.empty()) << later.notices[0];
}

TEST(Cost, OfABallOnATableFallsAsTheBudgetGrows) {
    const PreparedScene prepared = test::prepare(kBallOnTable);
    const CostTable table = measure(prepared, {"work:0", "work:30", "work:300", "work:1000000", "exact"}, 60);
    ASSERT_EQ(table.rows.size(), 5u);
    EXPECT_EQ(table.near_uncovered, 0u) << "of " << table.near_patches << " near ones";
    for (std::size_t k = 0; k + 1 < table.rows.size(); ++k) {
        const CostRow &tight = table.rows[k], &wide = table.rows[k + 1];
        EXPECT_GE(tight.contacts.spurious, wide.contacts.spurious) << tight.budget.name;
        EXPECT_LE(tight.level_reached_mean, wide.level_reached_mean) << tight.budget.name;
    }
    for (const CostRow& row : table.rows) {
        EXPECT_EQ(row.contacts.missed, 0u) << row.budget.name << ": what is untested counts as colliding";
        EXPECT_GT(row.contacts.reference, 0u);
        EXPECT_EQ(row.steps, 60u);
    }
    EXPECT_GT(table.rows.front().contacts.spurious, 1000u);
    EXPECT_GT(table.rows.front().trajectory.hausdorff, 1e-3) << "the ball is held where its spheres meet the table's";
    for (const CostRow& same : {table.rows[3], table.rows[4]}) EXPECT_TRUE(is_all_zero(same)) << same.name();
}

TEST(Cost, MissedPatchesAreUnseenWhereTheSurfacesAreNearInTheAnswerToo) {
    const auto of = [](std::initializer_list<std::uint16_t> cells) {
        PatchContacts list;
        for (const std::uint16_t cell : cells) list.push_back({{Thing::body(0), Thing::body(1), {cell, 0, 0}}, 1e-4});
        return list;
    };
    EXPECT_EQ(count_unseen(of({1, 2, 3, 5}), of({2, 4}), of({1, 2, 4, 5})), 2u);
    EXPECT_EQ(count_unseen(of({1, 2, 3, 5}), of({2, 4}), of({2, 4})), 0u) << "1, 3 and 5 are apart";
    PatchContacts presses = of({1});
    presses.front().patch.other = Thing::instrument(0);
    EXPECT_EQ(count_unseen(presses, {}, presses), 0u) << "of an instrument no search is compared";
}

/// A soft ball, somewhere above a table or above another soft ball that its lower part holds still.
std::string random_scene(Random& random, bool on_ball) {
    std::string text = kBallOnTable;
    const Vec3 shift = random.vector();
    text.replace(text.find("[0, 0, 32]"), 10, fmt::format("[{}, {}, {}]", 15.0 * shift.x(), 15.0 * shift.y(), on_ball ? 30.0 : 31.5 + shift.z()));
    if (!on_ball) return text;
    const std::size_t table = text.find(R"("table")"), end = text.find("}}", table) + 2;
    return text.replace(table, end - table,
                        R"("below": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, -30], "radius": 28, "subdivisions": 3},
            "material": {"young_modulus": 10, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.01, "mass_damping": 1},
            "coarse": {"mesher": "tetgen", "surface_triangles": 160}, "fixed": [{"direction": [0, 0, -1], "fraction": 0.4}]})");
}

/// Under any budget an answer has all that is near in its own state, by a search that shares nothing with it; or else counts it as open.
TEST(Cost, NoAnswerOverlooksWhatIsNearInItsOwnState) {
    Random random{11};
    std::size_t near_patches = 0;
    for (int scene = 0; scene < 6; ++scene) {
        const PreparedScene prepared = test::prepare(random_scene(random, scene % 2 == 1));
        PatchFinder finder(prepared.model, {12e-3, 0.3e-3});
        for (int run = 0; run < 3; ++run) {
            const auto work = static_cast<std::uint64_t>(std::pow(10.0, 3.0 + 3.0 * random.vector().x()));
            Simulator simulator(prepared.model, {BudgetMode::Work, 0.0, work});
            for (int step = 0; step < 80; ++step) {
                simulator.step();
                const PatchContacts near = finder.find_near(simulator.raw_state()), answer = finder.find_answer(simulator);
                near_patches += near.size();
                ASSERT_EQ(count_unseen(near, answer, near), 0u) << "seed 11, scene " << scene << ", work:" << work << ", step " << step;
            }
        }
    }
    EXPECT_GT(near_patches, 3000u);
}

TEST(Cost, OfThePapersSpherePushIsABallHeldUpWhereTheBudgetEnds) {
    std::string text = kBallOnTable;
    text.replace(text.find(R"("solid_stiffness": 1)"), 0, R"("solid_response": "spheres", )");
    const PreparedScene prepared = test::prepare(text);
    const CostTable table = measure(prepared, {"work:0", "exact"}, 60);
    ASSERT_EQ(table.rows.size(), 2u);
    EXPECT_GT(table.rows[0].trajectory.hausdorff, 1e-5) << "the root spheres overlap from the start";
    EXPECT_EQ(table.rows[1].trajectory.hausdorff, 0.0);
}

TEST(Cost, OfAWireInABentTubeNamesWhatWasSkipped) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({.host_body = test::kOrgan}));
    const CostTable table = measure(prepared, {"work:0", "1s", "exact"}, 120);
    EXPECT_EQ(table.rows[0].exact_steps, 0u);
    EXPECT_EQ(table.rows[1].exact_steps, 120u);
    EXPECT_EQ(table.rows[1].trajectory.hausdorff, 0.0) << "a second is no limit";
    EXPECT_TRUE(is_all_zero(table.rows[2]));
    for (const CostRow& row : table.rows) EXPECT_LE(row.surface.rms(), row.surface.hausdorff) << row.name();
    EXPECT_GT(table.rows[2].contacts.reference, 0u) << "the wire leans on the bend";
}

TEST(Cost, OfNoStepsIsATableOfNothing) {
    const PreparedScene prepared = test::prepare(kBallOnTable);
    CostTable table = measure(prepared, {"1ms", "exact"}, 0);
    EXPECT_EQ(table.rows.size(), 2u);
    const std::string csv = cost_csv(table);
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3);
}

TEST(Cost, TableHasTheContractsColumnsAndItsPageStandsAlone) {
    const Result<Scene> scene = parse_scene(kBallOnTable, "scenes/ball.json");
    ASSERT_TRUE(scene.ok());
    const PreparedScene prepared = test::prepare(kBallOnTable);
    CostTable table = measure(prepared, {"work:0", "1ms", "exact"}, 20);
    const std::string csv = cost_csv(table);
    EXPECT_TRUE(csv.starts_with("budget,step_ms_p50,step_ms_p99,budget_kept,pairs_open_mean,leaf_contacts_mean,level_reached_mean,"
                                "missed_contacts,false_contacts,depth_error_rms_m,force_error_rel,surface_rms_m,surface_hausdorff_m,"
                                "charged_ms_p50,charged_ms_p99,realtime_kept,trajectory_rms_m,trajectory_hausdorff_m,unseen_contacts\n"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), ','), 4 * 18);
    const auto json = nlohmann::json::parse(cost_json(*scene, table), nullptr, false);
    ASSERT_TRUE(json.is_object());
    EXPECT_EQ(json["rows"].size(), 3u);
    EXPECT_EQ(json["tolerance_m"], 0.3e-3);
    const std::string page = cost_page(*scene, table);
    EXPECT_NE(page.find("work:0"), std::string::npos);
    EXPECT_EQ(page.find("src=\"http"), std::string::npos);
    const bool plots = page.find("<svg") != std::string::npos;
    EXPECT_TRUE(plots || !table.notices.empty()) << "plots, or a notice that says why not";
    for (const char* time : {"Time charged to the budget: contact", "Time of the whole step", "of the whole step (rings)"})
        EXPECT_TRUE(!plots || page.find(time) != std::string::npos) << time;
    for (const CostRow& row : table.rows)
        for (const CostPoint& point : row.curve) {
            EXPECT_GT(point.step_ms, 0.0);
            EXPECT_GE(point.step_ms, point.charged_ms) << "collision detection is a part of the step";
        }
}

} // namespace
} // namespace trocar::engine
