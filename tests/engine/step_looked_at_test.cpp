// What a step leaves undone because nothing in it looks there: surfaces that wait, a lumen without time for its descent. Whoever looks
// finds what would have been there.
#include "engine/state/bit_hash.hpp"
#include "engine/state/state.hpp"
#include "step_fixture.hpp"

#include <vector>

namespace trocar::engine {
namespace {

PreparedScene breathing_tube() {
    return test::prepare(test::bent_tube_scene(
        {.effects = R"("elasticity", "damping", "breathing", "coarse_contact", "friction")", .host_body = test::kOrgan}));
}

TEST(LazyEvaluation, AStateThatIsReadInEveryStepIsTheOneThatIsReadAtTheEnd) {
    const PreparedScene prepared = breathing_tube();
    Simulator seen(prepared.model), unseen(prepared.model);
    const Vec3 corner = prepared.model.bodies[0].surface.vertices[5];
    std::size_t waited = 0;
    for (int step = 0; step < 60; ++step) {
        for (Simulator* simulator : {&seen, &unseen}) {
            Inputs inputs; // a user pulls at a surface that was not evaluated, and releases it
            if (step >= 20 && step < 40) inputs.pull = Pull{0, 5, corner + Vec3(2e-3, 4e-3, -1e-3)};
            ASSERT_TRUE(simulator->step(inputs).ok());
            ASSERT_TRUE(simulator->report().finite) << simulator->report().failure;
        }
        (void)hash_state(seen.state());
        EXPECT_FALSE(seen.raw_state().bodies[0].surface_deferred);
        waited += unseen.raw_state().bodies[0].surface_deferred;
        EXPECT_EQ(seen.report().pull_force_n, unseen.report().pull_force_n) << "step " << step;
        EXPECT_EQ(seen.report().pull_force_n > 0.0, step >= 20 && step < 40) << "step " << step;
    }
    EXPECT_EQ(waited, 60u);
    EXPECT_EQ(hash_state(seen.state()), hash_state(unseen.state()));
    fem::LinkFrames frames;
    const BodyModel& organ = prepared.model.bodies[0];
    std::vector<Vec3> placed = organ.surface.vertices;
    fem::update_embedded_surface(*organ.links, unseen.state().bodies[0].tissue.position, organ.surface.vertices, frames, placed);
    EXPECT_EQ(unseen.state().bodies[0].surface, placed);
    EXPECT_NE(placed, organ.surface.vertices) << "it breathes";
}

/// Steps that fail leave the state as it was, also what had not been evaluated.
TEST(LazyEvaluation, AFailedStepLeavesTheSurfaceOfTheLastGoodOne) {
    for (const int good : {0, 1, 7}) {
        PreparedScene prepared = breathing_tube();
        Simulator simulator(prepared.model), other(prepared.model);
        for (int step = 0; step < good; ++step) {
            ASSERT_TRUE(simulator.step().finite);
            ASSERT_TRUE(other.step().finite);
        }
        const std::uint64_t before = hash_state(other.state());
        prepared.model.max_substeps = 0;
        ASSERT_FALSE(simulator.step().finite);
        EXPECT_EQ(hash_state(simulator.state()), before) << "after " << good << " steps";
    }
}

/// A ball over a table, and the same ball alone.
TEST(LazyEvaluation, WhatSomethingCanTouchNeverWaits) {
    for (const bool table : {true, false}) {
        const std::string scene =
            R"({"units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 10}, "budget": "exact",
            "gravity": [0, 0, -9810], "bodies": {
            "ball": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, 16], "radius": 15, "subdivisions": 2},
                "coarse": {"mesher": "lattice", "surface_triangles": 120},
                "material": {"young_modulus": 30, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.005, "mass_damping": 2}})" +
            std::string(table ? R"(, "table": {"kind": "static",
                "surface": {"shape": "box", "centre": [0, 0, -20], "extent": [90, 90, 40], "cells": 5}})"
                              : "") +
            R"(}, "effects": ["elasticity", "gravity", "damping", "coarse_contact"]})";
        const PreparedScene prepared = test::prepare(scene);
        Simulator simulator(prepared.model);
        std::size_t touches = 0;
        for (int step = 0; step < 60; ++step) {
            ASSERT_TRUE(simulator.step().finite);
            ASSERT_EQ(simulator.raw_state().bodies[0].surface_deferred, !table) << "step " << step;
            touches += simulator.report().solid_touches;
        }
        EXPECT_EQ(touches > 0, table);
    }
}

/// Under nearly no budget the balls stay where the last descent left them. The next one that has time finds what it would have found.
TEST(LazyEvaluation, ALumenThatWasLeftOutIsFoundWhereItIs) {
    PreparedScene prepared = breathing_tube();
    prepared.model.budget_covers_step = true; // with the lumen on its account
    Simulator always(prepared.model), sometimes(prepared.model);
    std::size_t contacts = 0;
    for (int step = 0; step < 90; ++step) {
        const bool left_out = step % 20 < 13;
        Inputs inputs;
        inputs.budget = {left_out ? BudgetMode::Work : BudgetMode::Exact, 0.0, 1}; // nothing at all: the rod would be carried
        ASSERT_TRUE(always.step().finite);
        ASSERT_TRUE(sometimes.step(inputs).ok() && sometimes.report().finite);
        if (left_out) {
            EXPECT_LE(sometimes.report().pairs_tested, 1u);
            EXPECT_EQ(sometimes.report().assumed, 1u) << "told, not silent";
            continue;
        }
        const std::span<const Contact> all = always.sphere_contacts(), found = sometimes.sphere_contacts();
        ASSERT_EQ(all.size(), found.size()) << "step " << step;
        for (std::size_t k = 0; k < all.size(); ++k) {
            EXPECT_EQ(all[k].gap, found[k].gap);
            EXPECT_EQ(all[k].point, found[k].point);
            EXPECT_EQ(all[k].normal, found[k].normal);
        }
        contacts += all.size();
    }
    EXPECT_GT(contacts, 20u);
    EXPECT_EQ(hash_state(always.state()), hash_state(sometimes.state()));
}

} // namespace
} // namespace trocar::engine
