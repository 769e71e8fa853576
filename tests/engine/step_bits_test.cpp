// `work` mode comes to the same bits whatever the processor offers: whole runs, with every kind of kernel that the step dispatches.
#include "fem/tissue/kernels.hpp"
#include "step_fixture.hpp"

#include <thread>

namespace trocar::engine {
namespace {

/// Soft bodies that meet, one of them itself, on wrapped trees.
const std::string kSoftBodies = R"({
    "name": "soft-bodies",
    "units": {"length": "mm", "pressure": "kPa"},
    "time": {"step": 0.005, "duration": 1},
    "budget": "work:2000",
    "gravity": [0, 0, -9810],
    "bodies": {
        "box": {"kind": "deformable", "surface": {"shape": "box", "centre": [0, 0, 20.4], "extent": [40, 40, 40], "cells": 3},
            "material": {"young_modulus": 8, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.01, "mass_damping": 1},
            "coarse": {"surface_triangles": 80}},
        "table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -5], "extent": [120, 120, 10], "cells": 6}}
    },
    "contact": {"solid_stiffness": 1, "sphere_trees": "wrapped", "solid_friction": 0.2},
    "effects": ["elasticity", "gravity", "damping", "coarse_contact", "self_contact", "friction"]
})";

std::uint64_t run(const SceneModel& model, int steps) {
    Simulator simulator(model);
    for (int k = 0; k < steps; ++k) simulator.step();
    return hash_state(simulator.state());
}

class Bits : public ::testing::Test {
protected:
    ~Bits() override { fem::choose_isa(""); }
};

TEST_F(Bits, AreTheSameOnEveryInstructionSet) {
    for (const std::string& text : {kSoftBodies, test::bent_tube_scene({.budget = "work:20000", .host_body = test::kOrgan})}) {
        const PreparedScene prepared = test::prepare(text);
        ASSERT_TRUE(fem::choose_isa("portable"));
        const std::uint64_t portable = run(prepared.model, 25);
        int others = 0;
        for (const char* isa : {"avx2", "avx512"}) {
            if (!fem::choose_isa(isa)) continue;
            EXPECT_EQ(run(prepared.model, 25), portable) << prepared.model.name << " with " << isa;
            ++others;
        }
        if (others == 0) GTEST_SKIP() << "this processor has neither AVX2 nor AVX-512: nothing to compare";
    }
}

TEST_F(Bits, AreTheSameInAnyThreadAndWithOthersRunningBesideIt) {
    const PreparedScene prepared = test::prepare(kSoftBodies);
    const std::uint64_t alone = run(prepared.model, 40);
    std::array<std::uint64_t, 4> hashes{};
    std::vector<std::jthread> threads;
    for (std::uint64_t& hash : hashes) threads.emplace_back([&] { hash = run(prepared.model, 40); });
    threads.clear();
    for (const std::uint64_t hash : hashes) EXPECT_EQ(hash, alone) << "one model, several simulators";
}

} // namespace
} // namespace trocar::engine
