// Contact between solid bodies: where they rest, what a tight budget does to them, what one body receives and the other gives.
#include "engine/io/write_mesh.hpp"
#include "engine/step/solid/solid_stage.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "fem/tissue/integrate.hpp"
#include "step_fixture.hpp"

#include <algorithm>

namespace trocar::engine {
namespace {

struct Body {
    std::string name, surface;
    std::string more = {}; // of a deformable body
    bool moves = true;
};

std::string scene_of(const std::vector<Body>& bodies, const std::string& budget, const std::string& gravity,
                     const std::string& contact = "") {
    std::string list;
    for (const Body& body : bodies) {
        list += fmt::format(R"({}"{}": {{"kind": "{}", "surface": {})", list.empty() ? "" : ", ", body.name,
                            body.moves ? "deformable" : "static", body.surface);
        if (body.moves)
            list += R"(, "material": {"young_modulus": 30, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.005, "mass_damping": 2},
                "coarse": {"mesher": "lattice", "surface_triangles": 150})" +
                    body.more;
        list += "}";
    }
    return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 10}}, "budget": "{}",
        "gravity": {}, "bodies": {{{}}}, "contact": {{{}}}, "effects": ["elasticity", "gravity", "damping", "coarse_contact", "friction"]}})",
                       budget, gravity, list, contact);
}

const Body kTable{"table", R"({"shape": "box", "centre": [0, 0, -5], "extent": [120, 120, 10], "cells": 24})", "", false};
const Body kBall{"ball", R"({"shape": "sphere", "centre": [0, 0, 38], "radius": 30, "subdivisions": 3})"};
constexpr const char* kDown = "[0, 0, -9810]";

Vec3 middle(const std::vector<Vec3>& points) {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& p : points) sum += p;
    return sum / static_cast<double>(points.size());
}

double lowest(const std::vector<Vec3>& points) {
    double z = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points) z = std::min(z, p.z());
    return z;
}

/// Kinetic, elastic and potential energy of body 0, J.
double total_energy(Simulator& simulator) {
    const fem::TissueModel& tissue = *simulator.model().bodies[0].tissue;
    double potential = 0.0;
    for (std::size_t n = 0; n < tissue.inv_mass.size(); ++n)
        if (tissue.inv_mass[n] > 0.0) potential += 9.81 * simulator.state().bodies[0].tissue.position[n].z() / tissue.inv_mass[n];
    return potential + simulator.report().kinetic_j + simulator.report().elastic_j;
}

TEST(SolidContact, ABallRestsWhereItsSurfaceTouchesTheTable) {
    const PreparedScene prepared = test::prepare(scene_of({kBall, kTable}, "exact", kDown, "\"solid_friction\": 0.3"));
    ASSERT_EQ(prepared.model.bodies.size(), 2u);
    Simulator simulator(prepared.model);
    double largest = -1.0, deepest = 0.0;
    for (int k = 0; k < 500; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        if (largest < 0.0) largest = total_energy(simulator);
        EXPECT_LE(total_energy(simulator), 1.002 * largest) << report.step;
        deepest = std::max(deepest, report.deepest_touch_m);
    }
    const std::vector<Vec3>& surface = simulator.state().bodies[0].surface;
    EXPECT_LT(std::abs(lowest(surface)), 1e-3);
    EXPECT_LT(deepest, 4e-3);
    EXPECT_LT(std::hypot(middle(surface).x(), middle(surface).y()), 15e-3) << "it may roll from facet to facet";
    EXPECT_LT(simulator.report().kinetic_j, 1e-4) << "what its mass damping leaves of the fall: 9 mJ exp(-2 t)";
    EXPECT_GT(simulator.report().solid_touches, 2u);
    std::size_t pressed = 0;
    for (const Contact& contact : simulator.contacts())
        if (contact.origin == ContactOrigin::Proximity) {
            ++pressed;
            EXPECT_GT(std::abs(contact.normal.z()), 0.9);
            EXPECT_LT(std::abs(contact.point.z()), 2e-3);
        }
    EXPECT_EQ(pressed, simulator.report().solid_touches) << "the record has every place";
}

/// m; what a body's lowest place has above the table, the smaller the more the budget looks at.
struct Rest {
    double height = 0.0, under = 0.0;
};

TEST(SolidContact, UnderAnyBudgetABallIsHeldAboveTheTableTheNearerTheLargerItIs) {
    const Body wide{"table", R"({"shape": "box", "centre": [40, 70, -50], "extent": [2000, 2000, 100], "cells": 20})", "", false};
    for (const Body& table : {kTable, wide}) {
        std::vector<Rest> rests;
        for (const char* budget : {"work:0", "work:200", "work:1000", "work:3000", "work:30000", "work:300000"}) {
            SCOPED_TRACE(table.surface + " under " + budget);
            const PreparedScene prepared = test::prepare(scene_of({kBall, table}, budget, kDown, "\"solid_friction\": 0.3"));
            Simulator simulator(prepared.model);
            double largest = -1.0, under = 0.0;
            std::uint64_t left = 0;
            for (int k = 0; k < 500; ++k) {
                const StepReport& report = simulator.step();
                ASSERT_TRUE(report.finite);
                if (largest < 0.0) largest = total_energy(simulator);
                ASSERT_LE(total_energy(simulator), 1.002 * largest) << "step " << k;
                under = std::min(under, lowest(simulator.state().bodies[0].surface));
                left += report.left_pairs + report.assumed;
            }
            const std::vector<Vec3>& surface = simulator.state().bodies[0].surface;
            EXPECT_GT(under, -5e-3) << "it lands at 0.4 m/s";
            EXPECT_LT(std::hypot(middle(surface).x(), middle(surface).y()), left > 0 ? 40e-3 : 15e-3) << "it may roll from facet to facet";
            EXPECT_LT(simulator.report().kinetic_j, 2e-4) << "what its mass damping leaves of the fall: 9 mJ exp(-2 t)";
            if (lowest(surface) > 1e-3) EXPECT_GT(left, 0u) << "held where nothing touches, and said";
            if (!rests.empty()) EXPECT_LT(lowest(surface), rests.back().height + 1e-3);
            rests.push_back({lowest(surface), under});
        }
        EXPECT_LT(std::abs(rests.back().height), 1e-3);
    }
}

TEST(SolidContact, UnderAnyBudgetABlockStaysAboveTheTableAndLiesFlatWhereItIsLookedAt) {
    const Body block{"block", R"({"shape": "box", "centre": [3, 5, 12], "extent": [50, 40, 20], "cells": 5})"};
    for (const char* budget : {"work:0", "work:30", "work:300", "work:100000", "exact"}) {
        SCOPED_TRACE(budget);
        const PreparedScene prepared = test::prepare(scene_of({block, kTable}, budget, kDown, "\"solid_friction\": 0.3"));
        Simulator simulator(prepared.model);
        for (int k = 0; k < 400; ++k) ASSERT_TRUE(simulator.step().finite);
        const std::vector<Vec3>& surface = simulator.state().bodies[0].surface;
        const std::vector<Vec3>& rest = prepared.model.bodies[0].surface.vertices;
        EXPECT_GT(lowest(surface), -1e-3);
        EXPECT_LT(simulator.report().kinetic_j, 1e-4);
        if (simulator.report().left_pairs > 0) continue;
        double highest_corner = -1.0;
        for (std::size_t v = 0; v < surface.size(); ++v)
            if (rest[v].z() < 2.1e-3) highest_corner = std::max(highest_corner, surface[v].z());
        EXPECT_LT(highest_corner, 1e-3) << "all of its lower side lies on the table";
        EXPECT_LT((middle(surface) - Vec3(3e-3, 5e-3, middle(surface).z())).norm(), 1e-3);
    }
}

/// Fourteen balls in three layers over a tray of five slabs.
std::vector<Body> heap_in_a_tray() {
    std::vector<Body> bodies;
    for (int layer = 0, side = 3; side > 0; ++layer, --side)
        for (int i = 0; i < side * side; ++i) {
            const double x = 21.0 * (i % side - 0.5 * (side - 1)), y = 21.0 * (i / side - 0.5 * (side - 1));
            bodies.push_back({fmt::format("ball{}{}", layer, i),
                              fmt::format(R"({{"shape": "sphere", "centre": [{}, {}, {}], "radius": 10, "subdivisions": 2}})", x, y,
                                          11.0 + 17.0 * layer)});
        }
    bodies.push_back(kTable);
    for (int k = 0; k < 4; ++k) {
        const double away = k % 2 == 0 ? 37.5 : -37.5;
        const bool along_x = k < 2;
        bodies.push_back({fmt::format("wall{}", k),
                          fmt::format(R"({{"shape": "box", "centre": [{}, {}, 20], "extent": [{}, {}, 60], "cells": 6}})",
                                      along_x ? away : 0.0, along_x ? 0.0 : away, along_x ? 10 : 90, along_x ? 90 : 10),
                          "", false});
    }
    return bodies;
}

TEST(SolidContact, AHeapLiesInItsTrayUnderABudgetOfOneTest) {
    for (const char* budget : {"work:1", "exact"}) {
        SCOPED_TRACE(budget);
        const PreparedScene prepared = test::prepare(scene_of(heap_in_a_tray(), budget, kDown, "\"solid_friction\": 0.3"));
        ASSERT_EQ(prepared.model.bodies.size(), 19u);
        Simulator simulator(prepared.model);
        double deepest = 0.0;
        for (int k = 0; k < 250; ++k) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            ASSERT_EQ(report.inverted_tets, 0u);
            deepest = std::max(deepest, report.deepest_touch_m);
        }
        EXPECT_LT(deepest, 3e-3) << "of balls of 10 mm";
        for (std::size_t i = 0; i < 14; ++i) {
            const Vec3 at = middle(simulator.state().bodies[i].surface);
            EXPECT_GT(at.z(), 8e-3) << i;
            EXPECT_LT(std::max(std::abs(at.x()), std::abs(at.y())), 24e-3) << i;
        }
        for (std::size_t i = 0; i < 14; ++i)
            for (std::size_t j = 0; j < i; ++j)
                EXPECT_GT((middle(simulator.state().bodies[i].surface) - middle(simulator.state().bodies[j].surface)).norm(), 17e-3)
                    << i << " and " << j;
    }
}

TEST(SolidContact, ABudgetThatAlternatesEveryStepPumpsNoEnergy) {
    const PreparedScene prepared = test::prepare(scene_of({kBall, kTable}, "exact", kDown, "\"solid_friction\": 0.3"));
    Simulator simulator(prepared.model);
    double largest = -1.0;
    constexpr std::uint64_t kWorks[] = {0, 1000000, 20, 1000000, 400, 3, 1000000};
    for (int k = 0; k < 500; ++k) {
        Inputs inputs;
        inputs.budget = {BudgetMode::Work, 0.0, kWorks[static_cast<std::size_t>(k) % std::size(kWorks)]};
        ASSERT_TRUE(simulator.step(inputs).ok() && simulator.report().finite);
        if (largest < 0.0) largest = total_energy(simulator);
        ASSERT_LE(total_energy(simulator), 1.002 * largest) << "step " << k;
    }
    EXPECT_GT(lowest(simulator.state().bodies[0].surface), -2e-3);
}

TEST(SolidContact, WhatOneBodyReceivesTheOtherGives) {
    const Body left{"left", R"({"shape": "sphere", "centre": [-21, 0, 0], "radius": 20, "subdivisions": 3})"};
    const Body right{"right", R"({"shape": "sphere", "centre": [21, 3, 0], "radius": 20, "subdivisions": 3})"};
    for (const char* budget : {"exact", "work:40"}) {
        std::string text = scene_of({left, right}, budget, kDown);
        text.replace(text.find("\"gravity\", \"damping\", "), 22, ""); // nothing else acts
        const PreparedScene prepared = test::prepare(text);
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        const auto momentum = [&] {
            Vec3 sum = Vec3::Zero();
            for (std::size_t i = 0; i < 2; ++i)
                sum += fem::find_momentum(*prepared.model.bodies[i].tissue, simulator.state().bodies[i].tissue).linear;
            return sum;
        };
        State thrown = simulator.state();
        for (Vec3& v : thrown.bodies[0].tissue.velocity) v = Vec3(0.3, 0, 0);
        for (Vec3& v : thrown.bodies[1].tissue.velocity) v = Vec3(-0.3, 0, 0);
        ASSERT_TRUE(simulator.restore(thrown).ok());
        const State& state = simulator.state();
        const Vec3 before = momentum();
        const double scale = fem::find_momentum(*prepared.model.bodies[0].tissue, state.bodies[0].tissue).linear.norm();
        for (int k = 0; k < 80; ++k) ASSERT_TRUE(simulator.step().finite);
        const double left_now = fem::find_momentum(*prepared.model.bodies[0].tissue, state.bodies[0].tissue).linear.x();
        EXPECT_LT(left_now, 0.2 * scale) << "they have met";
        EXPECT_LT((momentum() - before).norm(), 1e-12 * scale) << budget;
    }
}

TEST(SolidContact, BeamsThatCrossEdgeOnEdgeHoldOneAnotherThoughNoVertexIsInside) {
    const Body upper{"upper", R"({"shape": "box", "centre": [0, 0, 16], "extent": [80, 10, 10], "cells": 1})"};
    const Body lower{"lower", R"({"shape": "box", "centre": [0, 0, 5], "extent": [10, 80, 10], "cells": 1})", "", false};
    const PreparedScene prepared = test::prepare(scene_of({upper, lower}, "exact", kDown));
    ASSERT_EQ(prepared.model.bodies.size(), 2u);
    Simulator simulator(prepared.model);
    for (int k = 0; k < 200; ++k) ASSERT_TRUE(simulator.step().finite);
    const Vec3 at = middle(simulator.state().bodies[0].surface);
    EXPECT_GT(at.z(), 0.005);
}

TEST(SolidContact, FrictionHoldsOnASlopeThatWithoutItIsSlippery) {
    const Body block{"block", R"({"shape": "box", "centre": [0, 0, 10.1], "extent": [30, 30, 20], "cells": 4})"};
    double slid[3] = {};
    const char* contact[] = {"\"solid_friction\": 0", "\"solid_friction\": 0.1", "\"solid_friction\": 0.6"};
    for (int k = 0; k < 3; ++k) {
        const PreparedScene prepared = test::prepare(scene_of({block, kTable}, "exact", "[3000, 0, -9200]", contact[k]));
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        for (int step = 0; step < 60; ++step) ASSERT_TRUE(simulator.step().finite);
        slid[k] = middle(simulator.state().bodies[0].surface).x();
    }
    EXPECT_GT(slid[0], 0.09) << "frictionless: half of 3 m/s^2 times (0.3 s)^2 is 135 mm, mass damping takes its share";
    EXPECT_LT(slid[1], 0.85 * slid[0]);
    EXPECT_LT(slid[2], 0.006) << "tan of the slope is 0.33: it creeps at most";
}

TEST(SolidContact, ThePapersSpherePenaltyIsThereAndFloatsOnItsSpheres) {
    const PreparedScene prepared =
        test::prepare(scene_of({kBall, kTable}, "exact", kDown, "\"solid_response\": \"spheres\", \"solid_damping\": 0.2"));
    ASSERT_EQ(prepared.model.bodies.size(), 2u);
    Simulator simulator(prepared.model);
    for (int k = 0; k < 300; ++k) ASSERT_TRUE(simulator.step().finite);
    const double height = lowest(simulator.state().bodies[0].surface);
    EXPECT_GT(height, 0.5e-3);
    EXPECT_LT(height, 15e-3);
    EXPECT_GT(simulator.report().held_pairs, 0u);
    EXPECT_EQ(simulator.report().solid_touches, 0u);
}

TEST(SolidContact, ThePapersModeIsStableUnderAnyBudget) {
    const char* const shapes[] = {R"({"shape": "sphere", "centre": [0, 0, 32], "radius": 20, "subdivisions": 3})",
                                  R"({"shape": "box", "centre": [0, 0, 32], "extent": [40, 30, 30], "cells": 5})",
                                  R"({"shape": "torus", "centre": [0, 0, 25], "radius": 22, "tube_radius": 9})"};
    for (const char* shape : shapes)
        for (const char* budget : {"work:0", "work:10", "work:100", "work:1000", "work:10000", "exact"}) {
            SCOPED_TRACE(std::string(shape) + " under " + budget);
            const PreparedScene prepared =
                test::prepare(scene_of({{"body", shape}, kTable}, budget, kDown,
                                       R"("solid_friction": 0.3, "solid_response": "spheres", "sphere_trees": "heuristic")"));
            ASSERT_EQ(prepared.model.bodies.size(), 2u);
            Simulator simulator(prepared.model);
            const double start = lowest(simulator.state().bodies[0].surface);
            double first = -1.0, most = 0.0, under = 0.0;
            for (int k = 0; k < 400; ++k) {
                const StepReport& report = simulator.step();
                ASSERT_TRUE(report.finite) << report.failure;
                if (first < 0.0) first = total_energy(simulator);
                most = std::max(most, total_energy(simulator));
                under = std::min(under, lowest(simulator.state().bodies[0].surface));
            }
            const double drop = prepared.model.bodies[0].tissue->mass * 9.81 * start;
            EXPECT_LT(most - first, 0.01 * drop) << "J of a drop of " << drop;
            EXPECT_GT(under, -3e-3) << "m: nothing passes through";
            EXPECT_LT(simulator.report().kinetic_j, 0.02 * drop) << "it rests";
        }
}

TEST(SolidContact, WhatPressedGoesOnPressingWhenTheBudgetIsTakenAway) {
    const char* const shapes[] = {R"({"shape": "sphere", "centre": [0, 0, 20.5], "radius": 20, "subdivisions": 3})",
                                  R"({"shape": "box", "centre": [0, 0, 15.5], "extent": [40, 30, 30], "cells": 5})",
                                  R"({"shape": "torus", "centre": [0, 0, 9.5], "radius": 22, "tube_radius": 9})"};
    for (const char* shape : shapes) {
        SCOPED_TRACE(shape);
        const PreparedScene prepared = test::prepare(scene_of({{"body", shape}, kTable}, "exact", kDown, R"("solid_friction": 0.3)"));
        Simulator simulator(prepared.model);
        for (int k = 0; k < 400; ++k) ASSERT_TRUE(simulator.step().finite);
        const double rested = lowest(simulator.state().bodies[0].surface);
        Inputs nothing;
        nothing.budget = BudgetLimits{BudgetMode::Work, 0.0, 0};
        std::uint64_t carried = 0;
        for (int k = 0; k < 200; ++k) {
            ASSERT_TRUE(simulator.step(nothing).ok());
            ASSERT_TRUE(simulator.report().finite);
            carried += simulator.report().carried_places;
            EXPECT_EQ(simulator.report().work_units, 0u);
        }
        EXPECT_GT(carried, 0u);
        EXPECT_NEAR(lowest(simulator.state().bodies[0].surface), rested, 0.3e-3);
        EXPECT_LT(simulator.report().kinetic_j, 1e-5);
    }
}

TEST(SolidContact, BetweenTwoScriptedBodiesNothingIsLookedFor) {
    const PreparedScene prepared = test::prepare(R"({"name": "scripts", "units": {"length": "mm", "pressure": "kPa"},
        "time": {"step": 0.005, "duration": 1}, "bodies": {
            "one": {"kind": "kinematic", "surface": {"shape": "box", "extent": [20, 20, 20], "cells": 4}, "motion": [[0, 0, 0, 0], [1, 30, 0, 0]]},
            "other": {"kind": "static", "surface": {"shape": "box", "centre": [15, 0, 0], "extent": [20, 20, 20], "cells": 4}}},
        "effects": ["coarse_contact"]})");
    Simulator simulator(prepared.model);
    for (int k = 0; k < 100; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite);
        EXPECT_EQ(report.pairs_tested + report.solid_touches + report.held_pairs + report.unproven_solids, 0u);
    }
}

/// Vertices that lie in no leaf above a triangle of theirs.
std::size_t count_escaped(const SceneModel& model, std::size_t body, const std::vector<Vec3>& surface, SolidScratch& solids) {
    const spheretree::SphereTree& tree = model.bodies[body].covering.tree;
    std::vector<std::uint8_t> held(surface.size(), 0);
    for (Index s = tree.level_begin[tree.level_count() - 1]; s < tree.sphere_count(); ++s) {
        const spheretree::Sphere& sphere = sphere_of(body, s, solids);
        for (const Index t : tree.items_of(s))
            for (const Index v : model.bodies[body].surface.triangles[t])
                if ((surface[v] - sphere.centre).norm() <= sphere.radius * (1.0 + 1e-12)) held[v] = 1;
    }
    return static_cast<std::size_t>(std::count(held.begin(), held.end(), 0));
}

TEST(SolidContact, WrappedTreesHoldTheSurfaceOverTheStepAndBeyondWhereThePapersHeuristicLosesSome) {
    const Body bar{"bar", R"({"shape": "box", "centre": [0, 0, 12], "extent": [110, 14, 14], "cells": 8})"};
    const Body post{"post", R"({"shape": "box", "centre": [0, 0, -6], "extent": [12, 40, 20], "cells": 4})", "", false};
    std::size_t lost[2] = {};
    for (const char* trees : {"wrapped", "heuristic"}) {
        const PreparedScene prepared =
            test::prepare(scene_of({bar, post}, "exact", kDown, fmt::format("\"sphere_trees\": \"{}\"", trees)));
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        ASSERT_TRUE(prepared.model.bodies[0].wrapped);
        Simulator simulator(prepared.model);
        for (int k = 0; k < 60; ++k) {
            const std::vector<Vec3> before = simulator.state().bodies[0].surface;
            ASSERT_TRUE(simulator.step().finite);
            SolidScratch& solids = ScratchView::of(simulator).solids;
            const std::vector<Vec3>& now = simulator.state().bodies[0].surface;
            std::vector<Vec3> ahead = now;
            for (std::size_t v = 0; v < now.size(); ++v) ahead[v] += now[v] - before[v];
            std::size_t& escaped = lost[trees == std::string("wrapped") ? 0 : 1];
            for (const std::vector<Vec3>* surface : {&before, &now, static_cast<const std::vector<Vec3>*>(&ahead)})
                escaped += count_escaped(prepared.model, 0, *surface, solids);
        }
    }
    EXPECT_EQ(lost[0], 0u);
    EXPECT_GT(lost[1], 0u) << "a bar that bends over a post";
}

TEST(SolidContact, OnWrappedTreesABlockRestsAsOnCoveringOnes) {
    const Body block{"block", R"({"shape": "box", "centre": [3, 5, 21], "extent": [50, 40, 40], "cells": 5})"};
    const Body table{"table", R"({"shape": "box", "centre": [0, 0, -15], "extent": [120, 120, 30], "cells": 8})", "", false};
    for (const char* trees : {"wrapped", "heuristic"})
        for (const char* budget : {"work:200", "exact"}) {
            SCOPED_TRACE(fmt::format("{} under {}", trees, budget));
            const PreparedScene prepared = test::prepare(
                scene_of({block, table}, budget, kDown, fmt::format("\"solid_friction\": 0.3, \"sphere_trees\": \"{}\"", trees)));
            ASSERT_EQ(prepared.model.bodies.size(), 2u);
            Simulator simulator(prepared.model);
            for (int k = 0; k < 300; ++k) ASSERT_TRUE(simulator.step().finite);
            EXPECT_LT(std::abs(lowest(simulator.state().bodies[0].surface)), 1e-3);
            EXPECT_LT(simulator.report().kinetic_j, 2e-5) << "slower than 20 mm/s";
        }
}

/// A square section of 8 mm along a hairpin: a lower prong, half a circle, an upper prong 8 mm above the lower one.
TriMesh hairpin() {
    struct Station {
        double x, z, angle; // mm, rad: the section's up is (sin, cos) of it
    };
    std::vector<Station> stations;
    for (int k = 0; k < 16; ++k) stations.push_back({60.0 - 3.75 * k, 0.0, 0.0});
    for (int k = 0; k <= 12; ++k) {
        const double a = 3.14159265358979 * k / 12.0;
        stations.push_back({-8.0 * std::sin(a), 8.0 - 8.0 * std::cos(a), -a});
    }
    for (int k = 1; k <= 16; ++k) stations.push_back({3.75 * k, 16.0, -3.14159265358979});
    TriMesh mesh;
    for (const Station& s : stations)
        for (int corner = 0; corner < 4; ++corner) {
            const double y = corner == 0 || corner == 3 ? -4.0 : 4.0, up = corner < 2 ? -4.0 : 4.0;
            mesh.vertices.push_back(1e-3 * Vec3(s.x - up * std::sin(s.angle), y, s.z + up * std::cos(s.angle)));
        }
    const auto quad = [&](Index a, Index b, Index c, Index d) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
    };
    const auto count = static_cast<Index>(stations.size());
    for (Index k = 0; k + 1 < count; ++k)
        for (Index c = 0; c < 4; ++c) quad(4 * k + c, 4 * k + 4 + c, 4 * k + 4 + (c + 1) % 4, 4 * k + (c + 1) % 4);
    quad(0, 1, 2, 3);
    const Index last = 4 * (count - 1);
    quad(last + 3, last + 2, last + 1, last);
    return mesh;
}

double lowest_of_the_upper_prong(const std::vector<Vec3>& rest, const std::vector<Vec3>& surface) {
    double z = 1.0;
    for (std::size_t v = 0; v < surface.size(); ++v)
        if (rest[v].z() > 11.9e-3 && rest[v].x() > 10e-3) z = std::min(z, surface[v].z());
    return z;
}

TEST(SolidContact, AHairpinUnderItsOwnWeightLiesOnItselfWhereTheSceneHasSelfContact) {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "hairpin.obj";
    ASSERT_TRUE(write_obj(file, hairpin()).ok());
    double height[3] = {};
    for (int k = 0; k < 3; ++k) { // with, without, with but not for this body
        const std::string text =
            fmt::format(R"({{"units": {{"length": "m", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 2}},
            "gravity": [0, 0, -9.81], "contact": {{"solid_stiffness": 50, "solid_damping": 0.05}}, "bodies": {{"pin": {{"kind": "deformable",
            "surface": "{}"{}, "coarse": {{"mesher": "tetgen", "surface_triangles": 368}}, "fixed": [{{"box": [[-1, -1, -1], [1, 1, -0.003]]}}],
            "material": {{"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.005, "mass_damping": 5}}}}}},
            "effects": ["elasticity", "gravity", "damping", "coarse_contact"{}]}})",
                        file.string(), k == 2 ? R"(, "self_contact": false)" : "", k == 1 ? "" : R"(, "self_contact")");
        const PreparedScene prepared = test::prepare(text);
        ASSERT_EQ(prepared.model.bodies.size(), 1u);
        Simulator simulator(prepared.model);
        double deepest = 0.0;
        for (int step = 0; step < 300; ++step) {
            ASSERT_TRUE(simulator.step().finite);
            deepest = std::max(deepest, simulator.report().deepest_touch_m);
        }
        height[k] = lowest_of_the_upper_prong(prepared.model.bodies[0].surface.vertices, simulator.state().bodies[0].surface);
        EXPECT_EQ(simulator.report().solid_touches > 0, k == 0);
        EXPECT_EQ(simulator.report().pairs_tested > 0, k == 0) << "left out, it costs nothing";
        if (k == 0) EXPECT_LT(deepest, 1e-3);
    }
    EXPECT_GT(height[0], 2.5e-3) << "the lower prong's upper side is at 4 mm";
    EXPECT_LT(height[1], 0.0) << "without, the upper prong falls through the lower one";
    EXPECT_EQ(height[1], height[2]);
}

} // namespace
} // namespace trocar::engine
