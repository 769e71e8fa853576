// Tissue that is advanced implicitly, in the step.
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

/// Two blocks, one of them a little above the other.
std::string two_blocks(const std::string& integrator, double gap, double step) {
    return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 10, "integrator": "{}"}}, "budget": "exact",
    "gravity": [0, 0, -9806.65],
    "bodies": {{
        "low": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, 0], "extent": [40, 40, 20], "cells": 4}},
            "material": {{"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "mass_damping": 5}}, "coarse": {{"mesher": "lattice", "surface_triangles": 200}},
            "fixed": [{{"direction": [0, 0, -1], "fraction": 0.2}}]}},
        "high": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, {}], "extent": [20, 20, 20], "cells": 4}},
            "material": {{"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "mass_damping": 5}}, "coarse": {{"mesher": "lattice", "surface_triangles": 200}}}}}},
    "effects": ["elasticity", "damping", "gravity", "coarse_contact", "friction"]}})",
                       step, integrator, 20.0 + gap);
}

/// m, of all bodies
double farthest_apart(const State& a, const State& b) {
    double most = 0.0;
    for (std::size_t body = 0; body < a.bodies.size(); ++body)
        for (std::size_t node = 0; node < a.bodies[body].tissue.position.size(); ++node)
            most = std::max(most, (a.bodies[body].tissue.position[node] - b.bodies[body].tissue.position[node]).norm());
    return most;
}

TEST(ImplicitTissue, FallsFreelyAndRestsOnAnotherBodyAsExplicitTissueDoes) {
    // What presses on another body is advanced side by side with it, by leapfrog; what does not, implicitly.
    const PreparedScene implicit = test::prepare(two_blocks("implicit", 4.0, 0.005)), leapfrog = test::prepare(two_blocks("leapfrog", 4.0, 0.005));
    ASSERT_TRUE(implicit.model.bodies[0].implicit.has_value());
    ASSERT_FALSE(leapfrog.model.bodies[0].implicit.has_value());
    Simulator one(implicit.model), other(leapfrog.model);
    bool alone = false, together = false;
    for (int k = 0; k < 300; ++k) {
        const StepReport& report = one.step();
        ASSERT_TRUE(report.finite) << report.failure;
        ASSERT_TRUE(other.step().finite);
        (report.substeps == 1 ? alone : together) = true;
        if (k == 3) { // 20 ms, before it lands
            EXPECT_LT((one.state().bodies[1].tissue.position[0] - other.state().bodies[1].tissue.position[0]).norm(), 1e-5); // leapfrog takes drag from the start of a sub-step
        }
    }
    EXPECT_TRUE(alone && together);
    EXPECT_LT(farthest_apart(one.state(), other.state()), 2e-4);
    const double weight = 9.81 * implicit.model.bodies[1].tissue->mass;
    EXPECT_NEAR(one.step().solid_force_n, weight, 0.05 * weight);
}

TEST(ImplicitTissue, MayBeOfSoManyNodesAndNoMore) {
    const Result<Scene> scene = parse_scene(R"({"units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 1, "integrator": "implicit"}, "budget": "exact",
        "bodies": {"block": {"kind": "deformable", "surface": {"shape": "box", "centre": [0, 0, 0], "extent": [40, 40, 40], "cells": 4},
            "material": {"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000}, "coarse": {"mesher": "lattice", "surface_triangles": 12000}}},
        "effects": ["elasticity"]})", "scenes/many.json");
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    ASSERT_FALSE(prepared.ok());
    EXPECT_NE(prepared.error().to_string().find("bodies.block.coarse"), std::string::npos) << prepared.error().to_string();
    EXPECT_NE(prepared.error().to_string().find("expected at most 5000"), std::string::npos) << prepared.error().to_string();
}

std::string held_bar(const std::string& material, const std::string& time) {
    return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}}, "time": {{{}}}, "budget": "exact",
    "bodies": {{"bar": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, 0], "extent": [40, 20, 20], "cells": 4}},
        "material": {{{}}}, "coarse": {{"mesher": "lattice", "surface_triangles": 200}}, "fixed": [{{"direction": [-1, 0, 0], "fraction": 0.2}}],
        "loads": [{{"force": [0, 0, -0.004], "where": {{"direction": [1, 0, 0], "fraction": 0.2}}}}]}}}},
    "effects": ["elasticity", "damping", "loads"]}})",
                       time, material);
}

/// Fibres and Ogden's law too: the same place as explicitly, in one sub-step a step or a few.
TEST(ImplicitTissue, OfEveryLawBendsAsExplicitTissueDoes) {
    for (const char* law : {R"("law": "stvk", "young_modulus": 20)", R"("law": "corotational", "young_modulus": 20)", R"("law": "neo_hookean", "young_modulus": 20)",
                            R"("law": "mooney_rivlin", "c10": 2, "c01": 1)", R"("law": "ogden", "mu1": 3, "alpha1": 4)",
                            R"("law": "hgo", "young_modulus": 20, "k1": 100, "k2": 20, "fibre1": [1, 0.5, 0], "fibre2": [1, -0.5, 0])"}) {
        std::vector<Vec3> ends[2];
        for (const std::string integrator : {"rk4", "implicit"}) {
            const std::string material = std::string(law) + R"(, "poisson_ratio": 0.4, "density": 1000, "mass_damping": 30)";
            const PreparedScene prepared = test::prepare(held_bar(material, R"("step": 0.02, "duration": 10, "integrator": ")" + integrator + "\""));
            Simulator simulator(prepared.model);
            std::uint64_t substeps = 0;
            for (int k = 0; k < 60; ++k) {
                const StepReport& report = simulator.step();
                ASSERT_TRUE(report.finite) << law << report.failure;
                substeps += report.substeps;
            }
            if (integrator == "implicit") {
                EXPECT_LE(substeps, 70u) << law;
            }
            ends[integrator == "implicit"] = simulator.state().bodies[0].tissue.position;
        }
        double way = 0.0, apart = 0.0;
        const PreparedScene rest = test::prepare(held_bar(std::string(law) + R"(, "poisson_ratio": 0.4, "density": 1000)", R"("step": 0.02, "duration": 10)"));
        for (std::size_t node = 0; node < ends[0].size(); ++node) {
            way = std::max(way, (ends[0][node] - rest.model.bodies[0].tissue->rest_position[node]).norm());
            apart = std::max(apart, (ends[0][node] - ends[1][node]).norm());
        }
        EXPECT_GT(way, 1e-4) << law;
        EXPECT_LT(apart, 0.01 * way) << law;
    }
}

TEST(ImplicitTissue, RefusesBranchesThatRelaxWithinAStep) {
    const std::string material = R"("young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "g1": 2, "tau1": 0.001)";
    const Result<Scene> scene = parse_scene(held_bar(material, R"("step": 0.01, "duration": 1, "integrator": "implicit")"), "scenes/bar.json");
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    ASSERT_FALSE(prepared.ok());
    EXPECT_NE(prepared.error().to_string().find("relaxes in 0.001 s; expected at least"), std::string::npos) << prepared.error().to_string();
}

/// Loads a hundred times what a body bears: an answer or a sentence, never a hang, and nothing that is not finite.
TEST(ImplicitTissue, UnderLoadsThatNothingBearsSaysSoOrBearsThem) {
    for (const double kpa : {2.0, 20.0, 2000.0, 200000.0}) {
        unsigned instead = 0;
        const PreparedScene prepared = test::prepare(fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}},
            "time": {{"step": 0.02, "duration": 1, "integrator": "implicit"}}, "budget": "exact",
            "bodies": {{"block": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, 0], "extent": [40, 20, 20], "cells": 4}},
                "material": {{"young_modulus": 20, "poisson_ratio": 0.45, "density": 1000}}, "coarse": {{"mesher": "lattice", "surface_triangles": 200}},
                "fixed": [{{"direction": [-1, 0, 0], "fraction": 0.2}}], "loads": [{{"pressure": {}, "where": {{"direction": [1, 0, 0], "fraction": 0.2}}}}]}}}},
            "effects": ["elasticity", "loads"]}})",
                                                                 kpa));
        Simulator simulator(prepared.model);
        for (int k = 0; k < 20; ++k) {
            const StepReport& report = simulator.step();
            instead += report.explicit_bodies;
            if (report.explicit_bodies > 0 && report.finite) {
                EXPECT_GT(report.substeps, 1u) << kpa;
            }
            if (!report.finite) {
                EXPECT_EQ(report.explicit_bodies, 1u) << "both ways were tried";
                EXPECT_FALSE(report.failure.empty());
                EXPECT_GT(kpa, 10.0) << report.failure; // as much as its Young's modulus, and more
                break;
            }
            for (const Vec3& x : simulator.state().bodies[0].tissue.position) ASSERT_TRUE(x.allFinite());
        }
        EXPECT_EQ(instead > 0, kpa > 10.0) << kpa << ": " << instead;
    }
}

} // namespace
} // namespace trocar::engine
