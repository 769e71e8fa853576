// Friction and pulse: there when a scene calls for them, and nothing of them otherwise.
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

constexpr const char* kWithFriction = R"("elasticity", "damping", "coarse_contact", "exact_contact", "friction")";
constexpr const char* kWithout = R"("elasticity", "damping", "coarse_contact", "exact_contact")";
constexpr double kMu = 0.05; // the instrument's default

struct Sliding {
    double largest_drag = 0.0, largest_share = 0.0, moved = 0.0;
};

/// The wire goes through the bend of a tube in an organ.
Sliding slide(const char* effects) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({35, "exact", effects, test::kOrgan}));
    Simulator simulator(prepared.model);
    Sliding seen;
    for (int k = 0; k < 250; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_EQ(report.lumen_exits, 0u);
        seen.largest_drag = std::max(seen.largest_drag, report.friction_force_n);
        if (report.contact_force_n > 0.0)
            seen.largest_share = std::max(seen.largest_share, report.friction_force_n / report.contact_force_n);
    }
    const std::vector<Vec3>& rest = prepared.model.bodies[0].tissue->rest_position;
    for (std::size_t n = 0; n < rest.size(); ++n)
        seen.moved = std::max(seen.moved, (simulator.state().bodies[0].tissue.position[n] - rest[n]).norm());
    return seen;
}

TEST(Friction, StaysInCoulombsConeAndReachesTheTissue) {
    const Sliding with = slide(kWithFriction), without = slide(kWithout);
    EXPECT_GT(with.largest_drag, 0.0);
    EXPECT_LE(with.largest_share, kMu * (1.0 + 1e-9));
    EXPECT_GT(with.largest_share, 0.5 * kMu) << "a wire that slides feels all of it somewhere";
    EXPECT_EQ(without.largest_drag, 0.0);
    EXPECT_NE(with.moved, without.moved);
}

TEST(Friction, AWireAtRestInAWallThatCarriesItFeelsNone) {
    // The tube takes a step sideways and back up along itself: what counts is the sliding on the wall, not the motion in the world.
    fem::RodDesign design;
    design.length = 0.1;
    design.tip = fem::TipShape::Straight;
    const auto model = fem::make_rod_model(design);
    ASSERT_TRUE(model.ok());
    fem::RodState state;
    const fem::RodPort port;
    fem::place_rod(*model, port, 0.08, 0.0, state);
    const Vec3 along(0.0, 0.0, 0.02); // m/s
    fem::RodDrive drive{port, 0.08 + 0.01 * along.z(), 0.0, Vec3::Zero(), 2000.0, 0.5};
    std::vector<fem::RodPlane> planes;
    const Index node = static_cast<Index>(model->node_count() - 8);
    for (const double side : {1.0, -1.0}) // pinched a little from both sides
        planes.push_back({node, 0.0, Vec3(side, 0, 0), side * state.position[node].x() + 1e-5, 0.0, along});
    fem::RodWorkspace workspace;
    (void)fem::solve_rod(*model, state, 0.01, 2, drive, planes, workspace);
    for (const fem::RodPlane& plane : planes) {
        EXPECT_GT(plane.force, 0.0);
        EXPECT_LT(plane.drag.norm(), 0.02 * plane.force) << "carried along";
    }
    planes[0].wall_velocity = planes[1].wall_velocity = Vec3::Zero();
    fem::place_rod(*model, port, 0.08, 0.0, state);
    (void)fem::solve_rod(*model, state, 0.01, 2, drive, planes, workspace);
    EXPECT_NEAR(planes[0].drag.z(), -0.5 * planes[0].force, 1e-3 * planes[0].force) << "sliding at 20 mm/s";
}

std::string pulsing_tube(const char* effects) {
    return fmt::format(R"({{
    "name": "pulse", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 2}}, "budget": "exact",
    "bodies": {{"tube": {{"kind": "static", "hollow": true,
        "surface": {{"shape": "tube", "axis": [[0, 0, 0, 3], [0, 0, 40, 3], [0, 0, 80, 3]], "sides": 24}}}}}},
    "instruments": {{"wire": {{"length": 120, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 800,
        "lumen": "tube", "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}}, "path": [[0, 20, 0], [1, 50, 0], [2, 60, 3]]}}}},
    "effects": {{"coarse_contact": true, "exact_contact": true{}}}
}})",
                       effects);
}

double mean_radius(const std::vector<Vec3>& surface) {
    double sum = 0.0, count = 0.0;
    for (const Vec3& v : surface)
        if (v.z() > 0.02 && v.z() < 0.06) sum += std::hypot(v.x(), v.y()), count += 1.0;
    return sum / count;
}

TEST(Pulse, WidensTheVesselByItsShareAndLetsItGoBack) {
    const PreparedScene prepared = test::prepare(pulsing_tube(R"(, "pulse": {"amplitude": 0.1, "period": 1})"));
    Simulator simulator(prepared.model);
    const std::vector<Vec3> rest = prepared.model.bodies[0].surface.vertices;
    double widest = 0.0;
    for (int k = 0; k < 200; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_EQ(report.lumen_exits, 0u) << "step " << report.step;
        EXPECT_EQ(report.safe_fraction, 1.0) << "step " << report.step;
        widest = std::max(widest, mean_radius(simulator.state().bodies[0].surface));
    }
    EXPECT_NEAR(widest / mean_radius(rest), 1.1, 0.01);
    const std::vector<Vec3>& end = simulator.state().bodies[0].surface;
    for (std::size_t v = 0; v < rest.size(); ++v) ASSERT_LT((end[v] - rest[v]).norm(), 1e-9) << "after two whole beats";
}

TEST(Pulse, LeftOutNothingMovesAndNothingIsKept) {
    const PreparedScene prepared = test::prepare(pulsing_tube(""));
    EXPECT_FALSE(prepared.model.bodies[0].moves());
    EXPECT_TRUE(prepared.model.bodies[0].pulse_reach.empty());
}

} // namespace
} // namespace trocar::engine
