// Only the effects that a scene calls for exist at run time: each left out runs none of its code, finds no memory, and changes no bit of a
// scene that did not need it.
#include "engine/effects/call.hpp"
#include "engine/experiments/effect_cost.hpp"
#include "engine/step/model_hash.hpp"
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

/// Every effect there is: a wire in a tube in breathing tissue that lies on a table.
std::string everything(const std::string& effects) {
    std::string host_body = test::kOrgan;
    host_body.insert(host_body.find("\"kind\""), R"("loads": [{"acceleration": [0, 0, -100]}], )");
    host_body +=
        R"("table": {"kind": "static", "surface": {"shape": "box", "centre": [10, 0, 24.8], "extent": [120, 120, 10], "cells": 6}},)";
    std::string text = test::bent_tube_scene({.budget = "work:100000", .effects = effects, .host_body = host_body});
    const std::string second = R"({"wire": {)";
    text.replace(text.find(second), second.size(), R"({"beside": {"length": 220, "radius": 0.4, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {"shape": "straight"}, "lumen": "tube", "entry": {"position": [1.5, 0, 10], "direction": [0, 0, 1]}, "path": [[0, 20, 0], [2, 60, 1]]},
        "wire": {)");
    text.replace(text.rfind('}'), 1, R"(, "gravity": [0, 0, -9810], "contact": {"solid_stiffness": 1, "solid_friction": 0.3}})");
    return text;
}

const std::vector<std::string> kAll{"elasticity",   "damping",       "gravity",  "breathing", "pulse",     "coarse_contact",
                                    "self_contact", "exact_contact", "friction", "twist",     "blood_drag",
                                    "contrast",     "loads",         "instrument_contact"};

std::string list_without(const std::string& left_out) {
    std::string list;
    for (const std::string& name : kAll)
        if (name != left_out && !(left_out == "coarse_contact" && (name == "self_contact" || name == "instrument_contact")) &&
            !(left_out == "blood_drag" && name == "contrast")) // which would find a flow of its own
            list += (list.empty() ? "\"" : ", \"") + name + "\"";
    return list;
}

PreparedScene prepare_without(const std::string& left_out) {
    std::string text = everything(list_without(left_out));
    const std::string weight = R"(, "gravity": [0, 0, -9810])";
    if (left_out == "gravity") text.erase(text.find(weight), weight.size());
    return test::prepare(text);
}

EffectCounts count(const SceneModel& model, int steps) {
    Simulator simulator(model);
    EffectCounts counts;
    for (int k = 0; k < steps; ++k) counts += simulator.step().effects;
    return counts;
}

TEST(EffectCounts, OfASceneWithEverythingAreAllAboveNothing) {
    const PreparedScene prepared = prepare_without("");
    const EffectCounts counts = count(prepared.model, 20);
    for (const EffectDescriptor* effect : registered_effects()) {
        if (!effect->in_step) continue;
        EXPECT_TRUE(has_effect(prepared.model, *effect)) << effect->name;
        EXPECT_GT(counts.of(*effect), 0u) << effect->name;
    }
}

TEST(EffectCounts, OfWhatIsLeftOutIsNothing) {
    for (const EffectDescriptor* effect : registered_effects()) {
        const PreparedScene prepared = prepare_without(std::string(effect->name));
        EXPECT_FALSE(has_effect(prepared.model, *effect)) << effect->name;
        EXPECT_EQ(count(prepared.model, 10).of(*effect), 0u) << effect->name;
    }
}

TEST(EffectCounts, AModelWithoutAnEffectIsTheOneThatIsPreparedWithoutIt) {
    const PreparedScene all = prepare_without("");
    for (const EffectDescriptor* effect : registered_effects()) {
        if (!effect->in_step) continue;
        const SceneModel less = without_effect(all.model, *effect);
        const PreparedScene prepared = prepare_without(std::string(effect->name));
        EXPECT_EQ(hash_model(less), hash_model(prepared.model)) << effect->name;
        Simulator a(less), b(prepared.model);
        for (int step = 0; step < 10; ++step) {
            a.step();
            b.step();
        }
        EXPECT_EQ(hash_state(a.state()), hash_state(b.state())) << effect->name;
    }
}

/// Effects that act on nothing in the scene.
TEST(EffectCounts, AnEffectThatActsOnNothingChangesNoBit) {
    const std::string tube =
        test::bent_tube_scene({.budget = "work:100000", .effects = R"("coarse_contact", "exact_contact", "friction")"});
    std::string more = test::bent_tube_scene(
        {.budget = "work:100000", .effects = R"("coarse_contact", "exact_contact", "friction", "elasticity", "damping", "self_contact")"});
    more.insert(more.find("\"young_modulus\""), R"("self_contact": false, )");
    std::uint64_t hashes[2];
    std::size_t k = 0;
    for (const std::string& text : {tube, more}) {
        const PreparedScene prepared = test::prepare(text);
        Simulator simulator(prepared.model);
        for (int step = 0; step < 40; ++step) simulator.step();
        hashes[k++] = hash_state(simulator.state());
        EXPECT_EQ(count(prepared.model, 5).of(effects::elasticity), 0u);
        EXPECT_EQ(count(prepared.model, 5).of(effects::self_contact), 0u);
    }
    EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(EffectCounts, WhatIsLeftOutFindsNoMemory) {
    const auto stepped = [](const PreparedScene& prepared) {
        auto simulator = std::make_unique<Simulator>(prepared.model);
        for (int k = 0; k < 3; ++k) simulator->step();
        return simulator;
    };
    const PreparedScene no_coarse = prepare_without("coarse_contact"), no_exact = prepare_without("exact_contact"),
                        no_self = prepare_without("self_contact"), no_pulse = prepare_without("pulse"),
                        no_elasticity = prepare_without("elasticity"), no_breathing = prepare_without("breathing"),
                        no_blood = prepare_without("blood_drag");
    const auto coarse_out = stepped(no_coarse), exact_out = stepped(no_exact), self_out = stepped(no_self), blood_out = stepped(no_blood),
               elasticity_out = stepped(no_elasticity), breathing_out = stepped(no_breathing);
    for (const SolidBodyScratch& body : ScratchView::of(*coarse_out).solids.bodies) {
        EXPECT_TRUE(body.spheres.empty());
        EXPECT_TRUE(body.surface_ahead.empty());
    }
    EXPECT_EQ(ScratchView::of(*exact_out).rods.instruments[0].tree.memory(), collision::DopTree().memory());
    for (const SolidBodyScratch& body : ScratchView::of(*self_out).solids.bodies) EXPECT_TRUE(body.self_near.empty());
    for (const BodyModel& body : no_pulse.model.bodies) EXPECT_TRUE(body.pulse_reach.empty());
    for (const BodyModel& body : no_blood.model.bodies) EXPECT_FALSE(body.blood.has_value());
    for (const InstrumentScratch& instrument : ScratchView::of(*blood_out).rods.instruments) EXPECT_TRUE(instrument.flow.empty());
    for (const TissueScratch& body : ScratchView::of(*elasticity_out).bodies.tissue) EXPECT_TRUE(body.pinned_target.empty());
    for (const TissueScratch& body : ScratchView::of(*breathing_out).bodies.tissue) EXPECT_TRUE(body.pinned_target.empty());
}

TEST(EffectCost, MeasuresEveryEffectOfASceneAndNoOther) {
    const PreparedScene prepared = prepare_without("pulse");
    const std::vector<EffectCost> costs = measure_effects(prepared.model, 12);
    const auto in_step = std::ranges::count_if(registered_effects(), [](const EffectDescriptor* effect) { return effect->in_step; });
    EXPECT_EQ(costs.size(), static_cast<std::size_t>(in_step) - 1);
    for (const EffectCost& cost : costs) {
        EXPECT_NE(cost.effect, &effects::pulse);
        EXPECT_GT(cost.entered, 0u) << cost.effect->name;
        EXPECT_EQ(cost.entered_without, 0u) << cost.effect->name;
        EXPECT_GT(cost.with_ms, 0.0);
    }
}

} // namespace
} // namespace trocar::engine
