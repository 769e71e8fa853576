// The wall's bounds refitted a part at a time: planes as from a refit of everything, to the bit.
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/make_scratch.hpp"
#include "engine/step/stages.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

void expect_same_planes(const InstrumentState& a, const InstrumentState& b, int step) {
    ASSERT_EQ(a.planes.size(), b.planes.size()) << "step " << step;
    for (std::size_t k = 0; k < a.planes.size(); ++k) {
        ASSERT_EQ(a.planes[k].node, b.planes[k].node) << "step " << step;
        ASSERT_EQ(a.planes[k].weight, b.planes[k].weight);
        ASSERT_EQ(a.planes[k].normal, b.planes[k].normal);
        ASSERT_EQ(a.planes[k].offset, b.planes[k].offset);
        ASSERT_EQ(a.planes[k].wall_velocity, b.planes[k].wall_velocity);
        ASSERT_EQ(a.presses[k].triangle, b.presses[k].triangle);
    }
}

TEST(WallAge, PlanesAreThoseOfAWholeRefit) {
    const PreparedScene prepared = test::prepare(
        test::bent_tube_scene({.effects = R"("elasticity", "damping", "breathing", "coarse_contact")", .host_body = test::kOrgan}));
    SceneModel model = prepared.model;
    model.effects.coarse_contact = false; // no descent, so that nothing is proven free: planes everywhere
    ASSERT_TRUE(model.bodies[1].moves());
    State state = make_initial_state(model);
    fem::place_rod(model.instruments[0].rod, model.instruments[0].port, 0.035, 0.0, state.instruments[0].rod);
    StepScratch parts = make_scratch(prepared.model, state), whole = make_scratch(prepared.model, state);
    std::size_t planes = 0;
    double drift = 0.0;
    for (int step = 0; step < 3 * static_cast<int>(WallAge::kParts); ++step, ++state.step) {
        for (StepScratch* context : {&parts, &whole}) {
            test::keep_whole_start(model, state, *context);
            context->rods.instruments[0].command = {0.035, 0.0};
        }
        // The tube goes to and fro by up to 0.7 mm a step, as whole as a breath and faster.
        const double share = wave_at(0.2, 0.01 * (step + 1));
        for (std::size_t v = 0; v < state.bodies[1].surface.size(); ++v)
            state.bodies[1].surface[v] = model.bodies[1].surface.vertices[v] + share * Vec3(2e-3, 1e-3, 4e-3);
        follow_wall(model, 1, state, parts.rods);
        refit_wall(model, 1, state, whole.rods);
        plane_from_wall(model, 0, state, parts.rods, kPlaneReach);
        const InstrumentState by_parts = state.instruments[0];
        plane_from_wall(model, 0, state, whole.rods, kPlaneReach);
        expect_same_planes(by_parts, state.instruments[0], step);
        planes += by_parts.planes.size();
        drift = std::max(drift, parts.rods.walls[1].age.drift);
        EXPECT_EQ(penetrates_wall(model, 0, state, parts.rods), penetrates_wall(model, 0, state, whole.rods)) << "step " << step;
    }
    EXPECT_GT(planes, 500u);
    EXPECT_GT(drift, 2e-3) << "old bounds were used";
}

/// Steps without a refit: the drift is not known, so that everything is refitted.
TEST(WallAge, AStepThatWasMissedAsksForAWholeRefit) {
    const PreparedScene prepared =
        test::prepare(test::bent_tube_scene({.effects = R"("elasticity", "breathing", "coarse_contact")", .host_body = test::kOrgan}));
    State state = make_initial_state(prepared.model);
    StepScratch context = make_scratch(prepared.model, state);
    for (const std::uint64_t step : {0, 1, 2, 7}) {
        state.step = step;
        test::keep_whole_start(prepared.model, state, context);
        for (Vec3& v : state.bodies[1].surface) v += Vec3(1e-3, 0, 0);
        follow_wall(prepared.model, 1, state, context.rods);
        EXPECT_NEAR(context.rods.walls[1].age.drift, step == 7 ? 0.0 : 1e-3 * static_cast<double>(step), 1e-9) << step;
    }
}

TEST(WallAge, AWholeRefitMakesItNew) {
    const PreparedScene prepared =
        test::prepare(test::bent_tube_scene({.effects = R"("elasticity", "breathing", "coarse_contact")", .host_body = test::kOrgan}));
    Simulator simulator(prepared.model);
    for (int k = 0; k < 40; ++k) simulator.step();
    EXPECT_GT(ScratchView::of(simulator).rods.walls[1].age.drift, 0.0) << "coarse contact alone follows in parts";
    const PreparedScene exact = test::prepare(
        test::bent_tube_scene({.effects = R"("elasticity", "breathing", "coarse_contact", "exact_contact")", .host_body = test::kOrgan}));
    Simulator other(exact.model);
    for (int k = 0; k < 40; ++k) other.step();
    EXPECT_EQ(ScratchView::of(other).rods.walls[1].age.drift, 0.0);
}

} // namespace
} // namespace trocar::engine
