// The price of accuracy: distances of surfaces, contacts as patches, budgets along the exact run's states.
#include "engine/observe/cost_page.hpp"
#include "engine/observe/gnuplot.hpp"
#include "step_fixture.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace seldinger::engine {
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
            "coarse": {"surface_triangles": 160}},
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

/// Every vertex against every triangle, both ways.
double hausdorff_by_brute_force(const TriMesh& mesh, const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double largest = 0.0;
    for (const auto& [from, to] : {std::pair{&a, &b}, std::pair{&b, &a}})
        for (const Vec3& p : *from) {
            double nearest = std::numeric_limits<double>::infinity();
            for (const Triangle& t : mesh.triangles)
                nearest = std::min(nearest, std::sqrt(closest_on_triangle(p, (*to)[t[0]], (*to)[t[1]], (*to)[t[2]]).distance_sq));
            largest = std::max(largest, nearest);
        }
    return largest;
}

TEST(SurfaceDistance, OfASurfaceToItselfIsNothing) {
    const TriMesh mesh = tent();
    const SurfaceDistance distance = measure_distance(mesh.triangles, mesh.vertices, mesh.vertices);
    EXPECT_EQ(distance.rms(), 0.0);
    EXPECT_EQ(distance.hausdorff, 0.0);
    EXPECT_EQ(distance.vertices, 4u);
}

TEST(SurfaceDistance, OfOneVertexThatMovedIsKnownByHand) {
    const TriMesh mesh = tent();
    std::vector<Vec3> moved = mesh.vertices;
    moved[3].z() = 3.0;
    const SurfaceDistance distance = measure_distance(mesh.triangles, mesh.vertices, moved);
    EXPECT_DOUBLE_EQ(distance.rms(), 1.0) << "2 m at one of four vertices";
    EXPECT_DOUBLE_EQ(distance.hausdorff, 2.0) << "from the far tip back to the near one";
}

TEST(SurfaceDistance, IsThatOfEveryVertexAgainstEveryTriangle) {
    const PreparedScene prepared = test::prepare(kBallOnTable);
    const TriMesh& ball = prepared.model.bodies.front().surface;
    std::uint64_t seed = 12345;
    const auto random = [&] {
        seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
        return static_cast<double>(seed >> 40) / static_cast<double>(1 << 24) - 0.5;
    };
    for (const double size : {1e-6, 1e-3, 0.05}) {
        std::vector<Vec3> moved = ball.vertices;
        for (Vec3& v : moved) v += size * Vec3(random(), random(), random()) + Vec3(2.0 * size, 0.0, 0.0);
        EXPECT_NEAR(measure_distance(ball.triangles, ball.vertices, moved).hausdorff, hausdorff_by_brute_force(ball, ball.vertices, moved),
                    1e-12)
            << "seed 12345, size " << size;
    }
}

TEST(SurfaceDistance, ToWhatIsNotFiniteIsInfinite) {
    const TriMesh mesh = tent();
    std::vector<Vec3> broken = mesh.vertices;
    broken[1].x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(std::isinf(measure_distance(mesh.triangles, mesh.vertices, broken).hausdorff));
}

TEST(Patches, DifferAsTheirListsDo) {
    const PatchId a{0, 1, {1, 0, 0}}, b{0, 1, {2, 0, 0}}, c{1, 0, {0, 0, 0}};
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
    const auto of_body = [&](BodyId body) {
        return std::count_if(near.begin(), near.end(), [&](const auto& c) { return c.patch.body == body; });
    };
    EXPECT_GT(of_body(0), 0);
    EXPECT_GT(of_body(1), 0);
    EXPECT_LT(of_body(1), 10) << "of some 300 patches of the table";
}

TEST(Join, AStepThatWasBegunElsewhereEndsTheSame) {
    std::string wrapped = kBallOnTable; // a box: a perfect sphere's medial axis is a point, which takes long
    const std::string ball = R"("shape": "sphere", "centre": [0, 0, 32], "radius": 30, "subdivisions": 3)";
    wrapped.replace(wrapped.find(ball), ball.size(), R"("shape": "box", "centre": [0, 0, 32], "extent": [60, 60, 60], "cells": 4)");
    wrapped.replace(wrapped.find(R"("solid_stiffness": 1)"), 0, R"("sphere_trees": "wrapped", )");
    for (const std::string& text : {kBallOnTable, wrapped, test::bent_tube_scene({.carrier = test::kOrgan})}) {
        const PreparedScene prepared = test::prepare(text);
        Simulator exact(prepared.model, BudgetLimits{}), other(prepared.model, BudgetLimits{});
        for (int step = 0; step < 60; ++step) {
            ASSERT_TRUE(exact.begin_step());
            other.join_step(exact);
            other.finish_step();
            exact.finish_step();
            ASSERT_EQ(hash_state(other.state()), hash_state(exact.state())) << prepared.model.name << ", step " << step;
            ASSERT_EQ(other.context().report.pairs_tested, exact.context().report.pairs_tested) << step;
            ASSERT_EQ(other.contacts().size(), exact.contacts().size()) << step;
        }
    }
}

CostTable measure(const PreparedScene& prepared, const std::vector<std::string>& budgets, std::uint64_t steps) {
    CostOptions options;
    for (const std::string& budget : budgets) options.budgets.push_back({budget, parse_budget(budget)->limits});
    options.steps = steps;
    return *measure_cost(prepared, {12e-3, 0.3e-3}, options);
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
    EXPECT_LT(table.rows.front().surface.hausdorff, 1e-5) << "what nobody tested is probed: the ball falls and lands all the same";
    for (const CostRow& same : {table.rows[3], table.rows[4]}) {
        EXPECT_EQ(same.contacts.spurious, 0u);
        EXPECT_EQ(same.depth_error_rms_m(), 0.0);
        EXPECT_EQ(same.force_error_rel, 0.0);
        EXPECT_EQ(same.surface.hausdorff, 0.0);
        EXPECT_EQ(same.surface.rms(), 0.0);
        EXPECT_EQ(same.pairs_open_mean, 0.0);
    }
}

TEST(Cost, OfThePapersSpherePushIsABallHeldUpWhereTheBudgetEnds) {
    std::string text = kBallOnTable;
    text.replace(text.find(R"("solid_stiffness": 1)"), 0, R"("solid_response": "spheres", )");
    const PreparedScene prepared = test::prepare(text);
    const CostTable table = measure(prepared, {"work:0", "exact"}, 60);
    ASSERT_EQ(table.rows.size(), 2u);
    EXPECT_GT(table.rows[0].surface.hausdorff, 1e-5) << "the root spheres overlap from the start";
    EXPECT_EQ(table.rows[1].surface.hausdorff, 0.0);
}

TEST(Cost, OfAWireInABentTubeNamesWhatWasSkipped) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({.carrier = test::kOrgan}));
    const CostTable table = measure(prepared, {"work:0", "1s", "exact"}, 120);
    EXPECT_EQ(table.rows[0].exact_steps, 0u);
    EXPECT_EQ(table.rows[1].exact_steps, 120u);
    EXPECT_EQ(table.rows[1].surface.hausdorff, 0.0) << "a second is no limit";
    EXPECT_EQ(table.rows[2].contacts.missed + table.rows[2].contacts.spurious, 0u);
    EXPECT_GT(table.rows[2].contacts.reference, 0u) << "the wire leans on the bend";
    EXPECT_EQ(table.rows[2].tip_distance_max_m, 0.0);
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
                                "missed_contacts,false_contacts,depth_error_rms_m,force_error_rel,surface_rms_m,surface_hausdorff_m\n"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), ','), 4 * 12);
    const auto json = nlohmann::json::parse(cost_json(*scene, table), nullptr, false);
    ASSERT_TRUE(json.is_object());
    EXPECT_EQ(json["rows"].size(), 3u);
    EXPECT_EQ(json["tolerance_m"], 0.3e-3);
    const std::string page = cost_page(*scene, table);
    EXPECT_NE(page.find("work:0"), std::string::npos);
    EXPECT_EQ(page.find("src=\"http"), std::string::npos);
    EXPECT_TRUE(page.find("<svg") != std::string::npos || !table.notices.empty()) << "plots, or a notice that says why not";
}

} // namespace
} // namespace seldinger::engine
