// Vessels with a wall of their own: what holds for any of them, and what a balloon and a pushed catheter do to them.
#include "engine/io/write_mesh.hpp"
#include "fem/tissue/forces.hpp"
#include "step_fixture.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace trocar::engine {
namespace {

struct Wall {
    double thickness = 1.0; // mm
    int layers = 2, triangles = 1200;
    double young_kpa = 100.0, nu = 0.45;
    std::string more;        // further keys of the body
    std::string surface = R"({"shape": "sphere", "radius": 10, "subdivisions": 3})";
    std::string effects = R"("elasticity", "damping", "loads")";
    double damping = 60.0;   // 1/s
    std::string instruments; // with its comma
    double step = 0.005;
    std::string integrator = "leapfrog";
};

std::string wall_scene(const Wall& w) {
    return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa", "angle": "deg"}},
    "time": {{"step": {}, "duration": 100, "integrator": "{}"}}, "budget": "exact",
    "bodies": {{"vessel": {{"kind": "deformable", "hollow": true, "surface": {},
        "material": {{"young_modulus": {}, "poisson_ratio": {}, "density": 1100, "mass_damping": {}}},
        "coarse": {{"mesher": "wall", "thickness": {}, "layers": {}, "surface_triangles": {}}}{}}}}}{},
    "effects": [{}]}})",
                       w.step, w.integrator, w.surface, w.young_kpa, w.nu, w.damping, w.thickness, w.layers, w.triangles, w.more, w.instruments, w.effects);
}

/// Mean way outwards of the surface's vertices, of a vessel about the origin.
double widening(Simulator& simulator, const SceneModel& model) {
    double sum = 0.0;
    const std::vector<Vec3>& rest = model.bodies[0].surface.vertices;
    for (std::size_t v = 0; v < rest.size(); ++v) sum += simulator.state().bodies[0].surface[v].norm() - rest[v].norm();
    return sum / static_cast<double>(rest.size());
}

std::vector<Triangle> boundary_surface_of(const PreparedScene& prepared) {
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    return boundary_surface(TetMesh{tissue.rest_position, tissue.tet_nodes}).triangles;
}

/// Of a tube along z.
std::string tube(double radius, double length) {
    return fmt::format(R"({{"shape": "vessels", "triangles": 4000, "branches": [[[0, 0, 0, {0}], [0, 0, {1}, {0}]]]}})", radius, length);
}

constexpr const char* kTubeHeld = R"(, "fixed": [{"direction": [0, 0, -1], "fraction": 0.06}, {"direction": [0, 0, 1], "fraction": 0.06}])";

} // namespace

TEST(VesselWall, WidensUnderBloodPressureAsLameSays) {
    for (const auto& [nu, integrator] : {std::pair{0.3, "leapfrog"}, {0.45, "leapfrog"}, {0.3, "implicit"}, {0.45, "implicit"}}) {
        const double pressure = 0.2; // kPa, of 100: small strain
        // On the bore alone: its nodes are near the lumen's surface.
        const Wall wall{.nu = nu, .more = fmt::format(R"(, "loads": [{{"pressure": {}, "where": {{"near": {{"surface": "vessel", "distance": 0.2}}}}}}])", pressure),
                        .integrator = integrator};
        const PreparedScene prepared = test::prepare(wall_scene(wall));
        Simulator simulator(prepared.model);
        for (int k = 0; k < 100; ++k) ASSERT_TRUE(simulator.step().finite);
        const double a3 = 1.0, b3 = std::pow(1.1, 3), found = widening(simulator, prepared.model);
        const double lame = pressure / wall.young_kpa * 0.01 * ((1.0 - 2.0 * nu) * a3 + (1.0 + nu) * 0.5 * b3) / (b3 - a3);
        EXPECT_NEAR(found / lame, 1.0, 0.05) << nu;
    }
}

TEST(VesselWall, UnderAPressureKeepsItsEnergyAtAnyStep) {
    // Undamped, from rest: what moves and what is strained is the pressure's work on the lumen. A pressure that followed the wall a step late would add more.
    std::mt19937_64 engine(9);
    for (const double step : {0.0005, 0.002, 0.01}) {
        const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
        const double kpa = between(0.5, 2.0);
        const Wall wall{.layers = step > 0.005 ? 2 : 1, .triangles = 500, .nu = between(0.3, 0.46),
                        .more = fmt::format(R"(, "spin": [3, 5, 4], "loads": [{{"pressure": {}, "where": {{"near": {{"surface": "vessel", "distance": 0.5}}}}}}])", kpa),
                        .effects = R"("elasticity", "loads")", .step = step};
        const PreparedScene prepared = test::prepare(wall_scene(wall));
        const std::vector<Triangle>& bore = prepared.model.bodies[0].loads[0].faces;
        const auto enclosed = [&](const std::vector<Vec3>& x) {
            double six = 0.0;
            for (const Triangle& t : bore) six += x[t[0]].dot(x[t[1]].cross(x[t[2]]));
            return std::abs(six) / 6.0;
        };
        ASSERT_EQ(2 * bore.size(), boundary_surface_of(prepared).size()); // all of it
        Simulator simulator(prepared.model);
        const std::vector<Vec3>& x = simulator.state().bodies[0].tissue.position;
        const double before = enclosed(x);
        double most = 0.0, first = 0.0;
        const int steps = static_cast<int>(0.12 / step);
        for (int k = 0; k < steps; ++k) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite);
            const double worked = 1e3 * kpa * (enclosed(x) - before), has = report.kinetic_j + report.elastic_j;
            if (k == 0) first = has - worked; // of the spin
            most = std::max(most, report.elastic_j);
            ASSERT_NEAR(has - worked, first, 0.03 * most + 0.01 * first) << step << " at " << k;
        }
        EXPECT_GT(most, 1e-6);
    }
}

TEST(VesselWall, HoweverThinIsPressedOnItsBoreAlone) {
    for (const double thickness : {0.05, 0.3, 1.0}) {
        const PreparedScene prepared = test::prepare(wall_scene(
            {.thickness = thickness, .more = R"(, "loads": [{"pressure": 1, "where": {"near": {"surface": "vessel", "distance": 0.5}}}])"}));
        const std::vector<Triangle>& faces = prepared.model.bodies[0].loads[0].faces;
        EXPECT_EQ(2 * faces.size(), boundary_surface_of(prepared).size()) << thickness;
        for (const Triangle& face : faces)
            for (const Index node : face) ASSERT_LT(3 * node, prepared.model.bodies[0].tissue->node_count()) << thickness; // of the first of three sheets
    }
}

TEST(VesselWall, OfOneLegOfABendIsNeverLinkedToTheOthers) {
    // Two legs 4 mm apart whose walls lie in one another.
    Wall wall{.thickness = 4.5, .layers = 1, .triangles = 1500};
    wall.surface = R"({"shape": "vessels", "triangles": 6000, "branches": [[[0, 0, 0, 5], [0, 0, 40, 5], [0, 0, 60, 5], [7, 0, 74, 5], [14, 0, 60, 5], [14, 0, 40, 5], [14, 0, 0, 5]]]})";
    const PreparedScene prepared = test::prepare(wall_scene(wall));
    const BodyModel& body = prepared.model.bodies[0];
    std::size_t between = 0;
    for (std::size_t v = 0; v < body.surface.vertices.size(); ++v) {
        const Vec3& p = body.surface.vertices[v];
        if (p.z() > 0.045) continue;
        between += std::abs(p.x() - 0.007) < 0.0025;
        for (const Index node : body.links->nodes_of(body.links->vertex_frame[v]))
            ASSERT_EQ(body.links->node_rest[node].x() < 0.007, p.x() < 0.007) << v;
    }
    EXPECT_GT(between, 20u);
}

TEST(VesselWall, CarriesItsMiddleWithIt) {
    Wall wall{.triangles = 700, .surface = tube(9.0, 60.0), .effects = R"("elasticity", "damping", "coarse_contact")"};
    wall.more = R"(, "fixed": [{"box": [[-50, -50, -50], [50, 50, 5]]}, {"box": [[-50, -50, 40], [50, 50, 90]], "moves": [[0, 0, 0, 0], [0.05, 4, 0, 0]]}])";
    wall.instruments = R"(, "instruments": {"wire": {"length": 100, "radius": 0.5, "young_modulus": 1e6, "density": 3000, "segment": 2, "skin_triangles": 1000,
        "inserted": 8, "entry": {"position": [0, 0, 3], "direction": [0, 0, 1]}, "lumen": "vessel", "follow": {"target": "end", "speed": 10}}},
        "targets": {"end": {"position": [0, 0, 57]}})";
    const PreparedScene prepared = test::prepare(wall_scene(wall));
    const InstrumentModel& wire = prepared.model.instruments[0];
    ASSERT_TRUE(wire.route_links.has_value());
    Simulator simulator(prepared.model);
    for (int k = 0; k < 12; ++k) ASSERT_TRUE(simulator.step().finite);
    std::vector<Vec3> moved(wire.route->points.size());
    fem::LinkFrames frames;
    fem::update_embedded_surface(*wire.route_links, simulator.state().bodies[0].tissue.position, wire.route->points, frames, moved);
    std::size_t carried = 0;
    for (std::size_t i = 0; i < moved.size(); ++i) {
        if (!(wire.route->points[i].z() > 0.046)) continue;
        EXPECT_LT((moved[i] - wire.route->points[i] - Vec3(0.004, 0.0, 0.0)).norm(), 1e-6) << i;
        ++carried;
    }
    EXPECT_GT(carried, 2u);
}

TEST(VesselWall, FollowsItsNodesWithItsWholeSurfaceAndRestsWhereNothingPulls) {
    std::mt19937_64 engine(5);
    for (int k = 0; k < 4; ++k) {
        const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
        Wall wall{.thickness = between(0.3, 2.0), .layers = 1 + k % 3, .triangles = 300 + 400 * k, .young_kpa = between(20.0, 500.0)};
        wall.surface = k % 2 == 0 ? wall.surface : tube(5.0, 40.0);
        const PreparedScene prepared = test::prepare(wall_scene(wall));
        const BodyModel& body = prepared.model.bodies[0];
        EXPECT_EQ(body.links->static_count, 0u);
        for (const double blend : body.links->vertex_blend) ASSERT_NEAR(blend, 1.0, 1e-12);
        Simulator simulator(prepared.model);
        for (int i = 0; i < 5; ++i) ASSERT_TRUE(simulator.step().finite);
        for (std::size_t v = 0; v < body.surface.vertices.size(); ++v)
            ASSERT_LT((simulator.state().bodies[0].surface[v] - body.surface.vertices[v]).norm(), 1e-12);
    }
}

namespace {

/// A stiff rod whose bent tip stands in a soft tube: it presses on one side with its tip, on the other with its back.
std::string pushed_rod(double young_gpa) {
    return fmt::format(R"(, "instruments": {{"wire": {{"length": 60, "radius": 0.5, "young_modulus": {}, "density": 3000,
        "tip": {{"shape": "J", "length": 12, "angle": 70, "stiffness": 1}}, "segment": 1, "skin_triangles": 2000, "inserted": 20,
        "entry": {{"position": [0, 0, 4], "direction": [0, 0, 1]}}, "lumen": "vessel", "path": [[0, 20, 0], [0.4, 26, 0]]}}}})",
                       1e6 * young_gpa);
}

struct Pressed {
    double out = 0.0, force = 0.0; // m, farthest that the wall went; N
    double gap = 0.0;              // N, between what the wall felt and what the rod did
    std::size_t exits = 0;
    bool finite = true;
};

Pressed press(const Wall& wall, int steps) {
    const PreparedScene prepared = test::prepare(wall_scene(wall));
    Simulator simulator(prepared.model);
    Pressed pressed;
    for (int k = 0; k < steps; ++k) {
        const StepReport& report = simulator.step();
        pressed.finite = pressed.finite && report.finite;
        pressed.exits += report.lumen_exits;
        pressed.force = report.contact_force_n;
        pressed.gap = report.exchange_gap_n;
    }
    const std::vector<Vec3>& rest = prepared.model.bodies[0].surface.vertices;
    for (std::size_t v = 0; v < rest.size(); ++v) pressed.out = std::max(pressed.out, (simulator.state().bodies[0].surface[v] - rest[v]).norm());
    return pressed;
}

} // namespace

TEST(VesselWall, GivesWayToAWireThatStandsInIt) {
    Wall wall{.thickness = 0.8, .triangles = 800, .young_kpa = 200.0, .more = kTubeHeld, .surface = tube(4.0, 50.0),
              .effects = R"("elasticity", "damping", "coarse_contact", "exact_contact")", .instruments = pushed_rod(0.5)};
    for (const double step : {0.005, 0.02}) {
        double last = 0.0;
        for (const double kpa : {400.0, 100.0}) {
            wall.young_kpa = kpa;
            wall.step = step;
            wall.integrator = "leapfrog";
            const int steps = static_cast<int>(0.8 / step);
            const Pressed pressed = press(wall, steps);
            EXPECT_TRUE(pressed.finite);
            EXPECT_EQ(pressed.exits, 0u) << kpa;
            EXPECT_GT(pressed.force, 1e-4) << kpa;
            if (step < 0.01) {
                EXPECT_LT(pressed.gap, 0.02 * pressed.force) << kpa; // at rest: action is reaction
            }
            EXPECT_GT(pressed.out, last) << kpa;                 // softer: farther
            last = pressed.out;
            wall.integrator = "implicit"; // rests at the same place with the same force
            const Pressed other = press(wall, steps);
            EXPECT_TRUE(other.finite);
            EXPECT_EQ(other.exits, 0u) << kpa;
            EXPECT_NEAR(other.force, pressed.force, 0.02 * pressed.force) << kpa << " kPa, steps of " << step;
            EXPECT_NEAR(other.out, pressed.out, 0.02 * pressed.out) << kpa << " kPa, steps of " << step;
            if (step < 0.01) {
                EXPECT_LT(other.gap, 0.02 * other.force) << kpa;
            }
        }
    }
}

TEST(VesselWall, ThatMovesAsABreathMovesItIsMetWhereItGoes) {
    // Both of its ends move across a rod that stands in it, 5 mm/s: what the wall felt in a step is what the rod did.
    for (const double kpa : {50.0, 400.0}) {
        Wall wall{.thickness = 0.8, .triangles = 800, .young_kpa = kpa, .surface = tube(4.0, 50.0),
                  .effects = R"("elasticity", "damping", "coarse_contact", "exact_contact")", .damping = 5.0, .instruments = pushed_rod(0.5), .integrator = "implicit"};
        const char* moves = R"("moves": [[0.4, 0, 0, 0], [0.8, 2, 0, 0]])";
        wall.more = fmt::format(R"(, "fixed": [{{"direction": [0, 0, -1], "fraction": 0.06, {0}}}, {{"direction": [0, 0, 1], "fraction": 0.06, {0}}}])", moves);
        const PreparedScene prepared = test::prepare(wall_scene(wall));
        Simulator simulator(prepared.model);
        double force = 0.0, gap = 0.0;
        for (int k = 0; k < 160; ++k) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            EXPECT_EQ(report.lumen_exits, 0u);
            if (k < 100) continue; // of the drive, and where the motion begins
            force += report.contact_force_n;
            gap += report.exchange_gap_n;
        }
        std::printf("%g kPa: gap %.5f N, force %.5f N\n", kpa, gap / 60.0, force / 60.0);
        EXPECT_GT(force, 0.0);
        EXPECT_LT(gap / 60.0, 0.006) << kpa; // N; 0.030 at 400 kPa where the wall is taken to go by inertia alone
    }
}

TEST(VesselWall, HoweverStiffAndThinTakesOneImplicitSubstep) {
    // An explicit step of 10 ms would take thousands.
    Wall wall{.thickness = 0.15, .layers = 1, .triangles = 800, .young_kpa = 5000.0, .more = kTubeHeld, .surface = tube(4.0, 50.0),
              .effects = R"("elasticity", "damping", "coarse_contact", "exact_contact")", .instruments = pushed_rod(0.5), .step = 0.01, .integrator = "implicit"};
    const PreparedScene prepared = test::prepare(wall_scene(wall));
    EXPECT_LT(prepared.bodies[0].stable_step_s, 0.01 / 1000.0);
    Simulator simulator(prepared.model);
    double force = 0.0;
    for (int k = 0; k < 100; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        ASSERT_EQ(report.substeps, 1u) << k;
        ASSERT_EQ(report.lumen_exits, 0u) << k;
        ASSERT_EQ(report.inverted_tets, 0u) << k;
        force = report.contact_force_n;
    }
    EXPECT_GT(force, 1e-3);
    const auto says = [&](const char* integrator, const char* words) {
        wall.integrator = integrator;
        const PreparedScene other = test::prepare(wall_scene(wall));
        EXPECT_EQ(other.model.bodies[0].implicit.has_value(), std::string(integrator) == "auto");
        for (const std::string& note : other.bodies[0].notes)
            if (note.find(words) != std::string::npos) return true;
        return false;
    };
    EXPECT_TRUE(says("auto", "advanced implicitly"));
    EXPECT_TRUE(says("leapfrog", "takes one"));
    wall.thickness = 1.0, wall.young_kpa = 20.0;
    wall.integrator = "auto"; // few sub-steps: explicit, and nothing is said
    const PreparedScene soft = test::prepare(wall_scene(wall));
    EXPECT_FALSE(soft.model.bodies[0].implicit.has_value());
    for (const std::string& note : soft.bodies[0].notes) EXPECT_EQ(note.find("implicit"), std::string::npos) << note;
}

TEST(VesselWall, IsRefusedWhereItIsNone) {
    const std::string sphere = R"("surface": {"shape": "sphere", "radius": 10, "subdivisions": 3})";
    const std::string head = R"({"units": {"length": "mm"}, "time": {"step": 0.01, "duration": 1}, "bodies": {"b": {"kind": "deformable", )" + sphere;
    const std::string tail = R"(}}, "effects": ["elasticity"]})";
    const auto message = [&](const std::string& keys) {
        const Result<Scene> scene = parse_scene(head + keys + tail, "scene.json");
        return scene.ok() ? std::string() : scene.error().to_string();
    };
    EXPECT_NE(message(R"(, "hollow": true)").find("would fill with tissue"), std::string::npos) << message(R"(, "hollow": true)");
    EXPECT_NE(message(R"(, "hollow": true, "coarse": {"mesher": "tetgen"})").find("would fill with tissue"), std::string::npos);
    EXPECT_NE(message(R"(, "coarse": {"mesher": "wall", "thickness": 1})").find("not hollow"), std::string::npos);
    EXPECT_NE(message(R"(, "hollow": true, "coarse": {"mesher": "wall"})").find("thickness"), std::string::npos);
    EXPECT_NE(message(R"(, "coarse": {"thickness": 1})").find("thickness"), std::string::npos);
    EXPECT_EQ(message(R"(, "hollow": true, "coarse": {"mesher": "wall", "thickness": 1})"), "");
}

TEST(VesselWall, ThatFoldsOverSaysWhere) {
    Wall wall{.thickness = 40.0, .surface = R"({"shape": "torus", "radius": 20, "tube_radius": 6, "sides": 40})"};
    const Result<Scene> scene = parse_scene(wall_scene(wall), "scene.json");
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    bool said = false;
    for (const std::string& note : prepared->bodies[0].notes) said = said || note.find("thinner at") != std::string::npos;
    EXPECT_TRUE(said);
}

} // namespace trocar::engine
