// Walls of vessels that are joined to the organ around them: what holds for any of them.
#include "engine/prepare/wall_ties.hpp"
#include "fem/tissue/forces.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/stable_step.hpp"
#include "step_fixture.hpp"

#include <cmath>
#include <numbers>

namespace trocar::engine {
namespace {

struct Joined {
    double wall_kpa = 100.0, organ_kpa = 10.0, wall_nu = 0.45, organ_nu = 0.45;
    double bore = 4.0, thickness = 1.0; // mm
    int layers = 1, wall_triangles = 700, organ_triangles = 500;
    std::string vessel, organ;  // further keys of each
    std::string vessel_surface; // of a tube through the organ, when empty
    std::string organ_surface;
    std::string effects = R"("elasticity", "damping", "loads")";
    std::string more; // further parts of the scene, each with its comma
    double damping = 60.0, step = 0.005;
    std::string integrator = "implicit";
};

std::string cylinder(double radius, double from, double to) {
    return fmt::format(R"({{"shape": "vessels", "triangles": 4000, "branches": [[[0, 0, {1}, {0}], [0, 0, {2}, {0}]]]}})", radius, from, to);
}

std::string joined_scene(const Joined& j) {
    return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa", "angle": "deg"}},
    "time": {{"step": {}, "duration": 100, "integrator": "{}"}}, "budget": "exact",
    "bodies": {{"vessel": {{"kind": "deformable", "hollow": true, "embedded_in": "organ", "surface": {},
        "material": {{"young_modulus": {}, "poisson_ratio": {}, "density": 1100, "mass_damping": {}}},
        "coarse": {{"mesher": "wall", "thickness": {}, "layers": {}, "surface_triangles": {}}}{}}},
      "organ": {{"kind": "deformable", "surface": {},
        "material": {{"young_modulus": {}, "poisson_ratio": {}, "density": 1000, "mass_damping": {}}},
        "coarse": {{"surface_triangles": {}}}{}}}}}{},
    "effects": [{}]}})",
                       j.step, j.integrator, j.vessel_surface.empty() ? cylinder(j.bore, 0.0, 48.0) : j.vessel_surface, j.wall_kpa, j.wall_nu, j.damping,
                       j.thickness, j.layers, j.wall_triangles, j.vessel, j.organ_surface.empty() ? cylinder(4.0 * j.bore, 8.0, 40.0) : j.organ_surface, j.organ_kpa,
                       j.organ_nu, j.damping, j.organ_triangles, j.organ, j.more, j.effects);
}

constexpr const char* kDown = R"(, "gravity": [0, -9810, 0])";
constexpr const char* kEndsHeld = R"(, "fixed": [{"direction": [0, 0, -1], "fraction": 0.05}, {"direction": [0, 0, 1], "fraction": 0.05}])";

std::string under_pressure(double kpa) {
    return fmt::format(R"(, "loads": [{{"pressure": {}, "where": {{"near": {{"surface": "vessel", "distance": 0.2}}}}}}])", kpa);
}

/// m; how far the bore of two tubes in one another goes outwards under a pressure, at constant length (Lame): in each u = A r + B / r.
double lame(const Joined& j, double pressure_kpa, double bore) {
    const double a = bore, b = bore + 1e-3 * j.thickness, c = 4.0 * 1e-3 * j.bore;
    const auto shear = [](double young, double nu) { return 1e3 * young / (2.0 * (1.0 + nu)); };
    const double g1 = 2.0 * shear(j.wall_kpa, j.wall_nu), g2 = 2.0 * shear(j.organ_kpa, j.organ_nu);
    const double s1 = 1.0 / (1.0 - 2.0 * j.wall_nu), s2 = 1.0 / (1.0 - 2.0 * j.organ_nu);
    Eigen::Matrix4d m;
    m << g1 * s1, -g1 / (a * a), 0, 0,              // what presses on the bore
        b, 1 / b, -b, -1 / b,                       // one place of both
        g1 * s1, -g1 / (b * b), -g2 * s2, g2 / (b * b), // one stress
        0, 0, g2 * s2, -g2 / (c * c);               // nothing outside
    const Eigen::Vector4d right(-1e3 * pressure_kpa, 0, 0, 0), ab = m.partialPivLu().solve(right);
    return ab[0] * a + ab[1] / a;
}

struct Bore {
    double radius = 0.0, widening = 0.0; // m, in the middle of its length
};

Bore find_bore(const SceneModel& model, const State& state, std::size_t layers = 1) {
    const fem::TissueModel& wall = *model.bodies[0].tissue;
    Bore bore;
    double count = 0.0;
    for (Index node = 0; (layers + 1) * node < wall.node_count(); ++node) { // the first sheet
        const Vec3& p = wall.rest_position[node];
        if (std::abs(p.z() - 0.024) > 0.006) continue;
        const double before = std::hypot(p.x(), p.y());
        bore.radius += before;
        bore.widening += std::hypot(state.bodies[0].tissue.position[node].x(), state.bodies[0].tissue.position[node].y()) - before;
        count += 1.0;
    }
    bore.radius /= count, bore.widening /= count;
    return bore;
}

double widening_over_lame(const Joined& j, int steps) {
    const double kpa = 0.001 * j.wall_kpa; // small strain
    Joined loaded = j;
    loaded.vessel = kEndsHeld + under_pressure(kpa);
    loaded.organ = kEndsHeld;
    const PreparedScene prepared = test::prepare(joined_scene(loaded));
    Simulator simulator(prepared.model);
    for (int k = 0; k < steps; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_TRUE(report.finite) << report.failure;
    }
    const Bore bore = find_bore(prepared.model, simulator.state(), static_cast<std::size_t>(j.layers));
    return bore.widening / lame(j, kpa, bore.radius);
}

/// A free vessel in a free organ, both of random make.
Joined random_pair(test::Random& random) {
    Joined j;
    j.wall_kpa = random.between(20.0, 300.0), j.organ_kpa = random.between(2.0, 100.0);
    j.wall_nu = random.between(0.3, 0.46), j.organ_nu = random.between(0.3, 0.46);
    j.thickness = random.between(0.5, 1.5);
    j.wall_triangles = 200, j.organ_triangles = static_cast<int>(random.between(80.0, 300.0));
    j.vessel_surface = R"({"shape": "sphere", "radius": 5, "subdivisions": 3})";
    j.organ_surface = R"({"shape": "sphere", "radius": 12, "subdivisions": 3})";
    j.effects = R"("elasticity")";
    j.integrator = "leapfrog";
    return j;
}

std::string turning(test::Random& random) {
    const Vec3 v = 100.0 * random.direction(), w = 300.0 * random.direction(); // mm/s, deg/s
    return fmt::format(R"(, "velocity": [{}, {}, {}], "spin": [{}, {}, {}])", v.x(), v.y(), v.z(), w.x(), w.y(), w.z());
}

fem::Momentum momentum_of(const SceneModel& model, const State& state) {
    fem::Momentum sum;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const fem::Momentum own = fem::find_momentum(*model.bodies[i].tissue, state.bodies[i].tissue);
        sum.linear += own.linear, sum.angular += own.angular;
    }
    return sum;
}

double largest_gap(const SceneModel& model, const State& state) {
    double most = 0.0;
    for (const fem::Tie& tie : model.bodies[0].joint->ties) {
        Vec3 gap = -state.bodies[0].tissue.position[tie.node];
        for (std::size_t k = 0; k < 4; ++k) gap += tie.weight[k] * state.bodies[1].tissue.position[tie.host[k]];
        most = std::max(most, gap.norm());
    }
    return most;
}

} // namespace

TEST(JoinedWall, WidensAsLameSaysOverMeshSizes) {
    const auto check = [](double organ_kpa, double nu, int triangles, double within) {
        const Joined j{.organ_kpa = organ_kpa, .wall_nu = nu, .organ_nu = nu, .layers = 2, .wall_triangles = 1200, .organ_triangles = triangles, .step = 0.02};
        const double found = widening_over_lame(j, 12);
        std::printf("organ %g kPa, nu %g, %d triangles: %.3f of Lame's\n", organ_kpa, nu, triangles, found);
        EXPECT_NEAR(found, 1.0, within) << organ_kpa << " kPa, nu " << nu << ", " << triangles;
    };
    check(0.05, 0.45, 100, 0.02); // the wall alone
    for (const auto& [organ_kpa, nu] : {std::pair{10.0, 0.3}, {10.0, 0.45}, {80.0, 0.45}, {80.0, 0.49}}) {
        check(organ_kpa, nu, 100, 0.10);
        check(organ_kpa, nu, 500, nu > 0.45 ? 0.20 : 0.06);
    }
    check(80.0, 0.49, 1500, 0.05);
}

TEST(JoinedWall, ComesToRestAtOnePlaceWhateverTheIntegrator) {
    Joined j{.wall_triangles = 300, .organ_triangles = 150};
    j.vessel = kEndsHeld + under_pressure(2.0);
    j.organ = kEndsHeld;
    double found[2] = {};
    for (const int explicitly : {0, 1}) {
        j.integrator = explicitly == 1 ? "leapfrog" : "implicit";
        const PreparedScene prepared = test::prepare(joined_scene(j));
        Simulator simulator(prepared.model);
        for (int k = 0; k < 160; ++k) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            ASSERT_EQ(report.substeps > 1, explicitly == 1);
            ASSERT_EQ(report.explicit_bodies, 0u);
        }
        found[explicitly] = find_bore(prepared.model, simulator.state()).widening;
    }
    EXPECT_GT(found[0], 1e-5);
    EXPECT_NEAR(found[1], found[0], 1e-3 * found[0]);
}

TEST(JoinedWall, KeepsMomentumAndEnergyInSubsteps) {
    test::Random random(31);
    for (int k = 0; k < 6; ++k) {
        Joined j = random_pair(random);
        j.vessel = turning(random), j.organ = turning(random); // apart: the ties stretch
        j.damping = 0.0;
        j.step = random.step();
        const PreparedScene prepared = test::prepare(joined_scene(j));
        Simulator simulator(prepared.model);
        const fem::Momentum before = momentum_of(prepared.model, simulator.state());
        double has = 0.0;
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t n = 0; n < prepared.model.bodies[i].tissue->node_count(); ++n)
                has += 0.5 * prepared.model.bodies[i].tissue->node_mass[n] * simulator.state().bodies[i].tissue.velocity[n].squaredNorm();
        double elastic = 0.0;
        const int steps = static_cast<int>(0.05 / j.step) + 1;
        for (int i = 0; i < steps; ++i) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            ASSERT_NEAR(report.kinetic_j + report.elastic_j, has, 0.03 * has) << k << " at " << i << " of " << j.step;
            elastic = std::max(elastic, report.elastic_j);
        }
        EXPECT_GT(elastic, 1e-3 * has);
        const fem::Momentum after = momentum_of(prepared.model, simulator.state());
        EXPECT_LT((after.linear - before.linear).norm(), 1e-10 * before.linear.norm()) << k;
        EXPECT_LT((after.angular - before.angular).norm(), 1e-9 * before.angular.norm()) << k;
    }
}

TEST(JoinedWall, NeverGainsEnergyInImplicitSteps) {
    test::Random random(7);
    for (int k = 0; k < 4; ++k) {
        Joined j = random_pair(random);
        j.vessel = turning(random), j.organ = turning(random);
        j.damping = 0.0;
        j.step = random.step();
        j.integrator = "implicit";
        const PreparedScene prepared = test::prepare(joined_scene(j));
        Simulator simulator(prepared.model);
        double has = 0.0;
        for (int i = 0; i < 40; ++i) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            const double now = report.kinetic_j + report.elastic_j;
            if (i > 0) {
                ASSERT_LT(now, 1.001 * has) << k << " at " << i << " of " << j.step;
            }
            has = i == 0 ? now : std::min(has, now);
        }
    }
}

TEST(JoinedWall, HasAStableStepThatBoundsTheWholePairs) {
    // The fastest mode of both bodies and their ties, by power iteration, is no faster than the preparation of sub-steps takes it to be.
    test::Random random(5);
    for (int k = 0; k < 6; ++k) {
        const PreparedScene prepared = test::prepare(joined_scene(random_pair(random)));
        const SceneModel& model = prepared.model;
        double bound = 0.0;
        for (const BodyModel& body : model.bodies) {
            fem::ContactSprings ties;
            ties.tied = body.tied;
            fem::StableStepWorkspace workspace;
            bound = std::max(bound, fem::find_stable_step(*body.tissue, body.tissue->rest_position, &ties, workspace, fem::Integrator::Leapfrog).omega_max);
        }
        std::vector<std::vector<Vec3>> mode, product;
        for (const BodyModel& body : model.bodies) {
            mode.emplace_back();
            for (std::size_t n = 0; n < body.tissue->node_count(); ++n) mode.back().push_back(random.direction());
        }
        double rate_sq = 0.0;
        for (int round = 0; round < 60; ++round) {
            product.clear();
            for (std::size_t i = 0; i < 2; ++i) {
                const fem::TissueModel& tissue = *model.bodies[i].tissue;
                std::vector<Vec3> back(tissue.node_count(), Vec3::Zero());
                fem::add_stiffness_product(tissue, tissue.rest_position, mode[i], back);
                product.push_back(std::move(back));
            }
            for (const fem::Tie& tie : model.bodies[0].joint->ties) {
                Vec3 gap = -mode[0][tie.node];
                for (std::size_t c = 0; c < 4; ++c) gap += tie.weight[c] * mode[1][tie.host[c]];
                product[0][tie.node] -= tie.stiffness * gap;
                for (std::size_t c = 0; c < 4; ++c) product[1][tie.host[c]] += tie.weight[c] * tie.stiffness * gap;
            }
            double norm_sq = 0.0, was_sq = 0.0;
            for (std::size_t i = 0; i < 2; ++i)
                for (std::size_t n = 0; n < product[i].size(); ++n) {
                    const double mass = model.bodies[i].tissue->node_mass[n];
                    product[i][n] /= mass;
                    norm_sq += mass * product[i][n].squaredNorm();
                    was_sq += mass * mode[i][n].squaredNorm();
                }
            rate_sq = std::sqrt(norm_sq / was_sq);
            for (std::size_t i = 0; i < 2; ++i)
                for (std::size_t n = 0; n < product[i].size(); ++n) mode[i][n] = product[i][n] / rate_sq;
        }
        EXPECT_LT(std::sqrt(rate_sq), 1.03 * bound) << k; // derived by a power iteration of its own
        EXPECT_GT(std::sqrt(rate_sq), 0.3 * bound) << k;
    }
}

TEST(JoinedWall, RestsWhereNothingPulls) {
    test::Random random(3);
    for (const char* integrator : {"leapfrog", "implicit"}) {
        Joined j = random_pair(random);
        j.integrator = integrator;
        const PreparedScene prepared = test::prepare(joined_scene(j));
        Simulator simulator(prepared.model);
        for (int k = 0; k < 10; ++k) ASSERT_TRUE(simulator.step().finite);
        EXPECT_LT(largest_gap(prepared.model, simulator.state()), 1e-15);
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t n = 0; n < prepared.model.bodies[i].tissue->node_count(); ++n)
                ASSERT_LT((simulator.state().bodies[i].tissue.position[n] - prepared.model.bodies[i].tissue->rest_position[n]).norm(), 1e-12);
    }
}

TEST(JoinedWall, ThatIsHeldHoldsItsOrganUp) {
    for (const char* integrator : {"leapfrog", "implicit"}) {
        Joined j{.wall_triangles = 300, .organ_triangles = 150, .effects = R"("elasticity", "damping", "gravity")", .more = kDown, .integrator = integrator};
        j.vessel = R"(, "fixed": [{"box": [[-90, -90, -90], [90, 90, 90]]}])"; // all of it
        const PreparedScene prepared = test::prepare(joined_scene(j));
        Simulator simulator(prepared.model);
        for (int k = 0; k < 100; ++k) ASSERT_TRUE(simulator.step().finite);
        double lowest = 0.0;
        for (std::size_t n = 0; n < prepared.model.bodies[1].tissue->node_count(); ++n)
            lowest = std::min(lowest, simulator.state().bodies[1].tissue.position[n].y() - prepared.model.bodies[1].tissue->rest_position[n].y());
        EXPECT_LT(lowest, -1e-6) << integrator;
        EXPECT_GT(lowest, -0.01) << integrator;
    }
}

TEST(JoinedWall, ElsewhereThanItsOrganLeavesItAsItIs) {
    Joined j{.wall_triangles = 300, .organ_triangles = 150};
    j.vessel_surface = cylinder(4.0, 100.0, 140.0);
    const PreparedScene apart = test::prepare(joined_scene(j));
    EXPECT_FALSE(apart.model.bodies[0].joint.has_value());
    EXPECT_TRUE(apart.model.bodies[1].tied.empty());
    ASSERT_EQ(apart.notices.size(), 1u);
    EXPECT_NE(apart.notices[0].find("it is not joined"), std::string::npos) << apart.notices[0];
    double mass = 0.0;
    for (const fem::TetShape& shape : apart.model.bodies[1].tissue->tet_shape) mass += 1000.0 * shape.volume;
    EXPECT_NEAR(apart.model.bodies[1].tissue->mass, mass, 1e-12 * mass);
    for (const fem::TetShape& shape : apart.model.bodies[1].tissue->tet_shape) ASSERT_EQ(shape.stiffness, 1.0);
    j.vessel_surface.clear();
    const PreparedScene inside = test::prepare(joined_scene(j));
    const double displaced = 1000.0 * std::numbers::pi * (25e-6 * 0.048 + 4.0 / 3.0 * 125e-9); // with round ends
    EXPECT_NEAR(mass - inside.model.bodies[1].tissue->mass, displaced, 0.1 * displaced);
}

TEST(JoinedWall, GoesOnWithItsOrganWhereSomethingStrikesThat) {
    // A ball falls on the organ: contact joins the organ to an island, its wall comes along, and afterwards steps are implicit again.
    Joined j{.wall_triangles = 200, .organ_triangles = 150, .effects = R"("elasticity", "damping", "gravity", "coarse_contact")", .more = kDown, .step = 0.002, .integrator = "auto"};
    j.organ = R"(, "fixed": [{"direction": [0, -1, 0], "fraction": 0.1}])";
    std::string scene = joined_scene(j);
    const std::string ball = R"("ball": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 24, 24], "radius": 6, "subdivisions": 2},
        "material": {"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "mass_damping": 5}, "coarse": {"surface_triangles": 60}, "velocity": [0, -500, 0]}, )";
    const auto at = scene.find("\"vessel\": {");
    ASSERT_NE(at, std::string::npos);
    scene.insert(at, ball);
    const PreparedScene prepared = test::prepare(scene);
    Simulator simulator(prepared.model);
    double force = 0.0;
    for (int k = 0; k < 60; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        force = std::max(force, report.solid_force_n);
        double most = 0.0;
        for (const fem::Tie& tie : prepared.model.bodies[1].joint->ties) {
            Vec3 gap = -simulator.state().bodies[1].tissue.position[tie.node];
            for (std::size_t c = 0; c < 4; ++c) gap += tie.weight[c] * simulator.state().bodies[2].tissue.position[tie.host[c]];
            most = std::max(most, gap.norm());
        }
        ASSERT_LT(most, 2e-3) << k;
    }
    EXPECT_GT(force, 0.01);
}

TEST(JoinedWall, IsRefusedWhereItCannotBe) {
    const auto refused = [](const Joined& j, const char* says) {
        const Result<Scene> scene = parse_scene(joined_scene(j), "scenes/step.json");
        ASSERT_FALSE(scene.ok()) << says;
        EXPECT_NE(scene.error().to_string().find(says), std::string::npos) << scene.error().to_string();
        EXPECT_NE(scene.error().to_string().find("embedded_in"), std::string::npos) << scene.error().to_string();
    };
    Joined j;
    j.organ = R"(, "embedded_in": "vessel")";
    refused(j, "found an organ in another");
    std::string text = joined_scene({});
    const auto replaced = [&](const std::string& name) {
        std::string other = text;
        other.replace(other.find("\"embedded_in\": \"organ\""), 22, "\"embedded_in\": \"" + name + "\"");
        return other;
    };
    for (const auto& [name, says] : {std::pair{"vessel", "is the vessel itself"}, {"orgn", "nearest known deformable body: \"organ\""}}) {
        const Result<Scene> scene = parse_scene(replaced(name), "scenes/step.json");
        ASSERT_FALSE(scene.ok()) << name;
        EXPECT_NE(scene.error().to_string().find(says), std::string::npos) << scene.error().to_string();
        EXPECT_EQ(scene.error().to_string().find("known: vessel"), std::string::npos) << scene.error().to_string();
    }
}

} // namespace trocar::engine
