// Planes that reach only as far as the motion suggests: the solve between them is that between all planes.
#include "engine/step/instrument_stage.hpp"
#include "engine/step/tissue_stage.hpp"
#include "hand_clock.hpp"
#include "step_fixture.hpp"

namespace seldinger::engine {
namespace {

/// A wire pushed through the bend, half a step by each way of solving. `advance` in m for a step.
struct Course {
    std::size_t presses = 0, planes_short = 0, planes_all = 0;
};

Course push_through_the_bend(double advance, int steps) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene(
        {.speed = 1e3, .effects = R"("elasticity", "damping", "breathing", "coarse_contact", "friction")", .carrier = test::kOrgan}));
    SceneModel model = prepared.model;
    model.effects.coarse_contact = false; // no descent, so that nothing is proven free: planes everywhere
    State near_state = make_initial_state(model), all_state = near_state;
    StepContext near = make_step_context(prepared.model, near_state), all = make_step_context(prepared.model, all_state);
    hand_clock::HandClock clock;
    StepBudget budget(clock, {});
    budget.begin();
    Course course;
    double insertion = near_state.instruments[0].rod.insertion;
    for (int step = 0; step < steps; ++step) {
        insertion += advance;
        for (State* state : {&near_state, &all_state}) {
            StepContext& context = state == &near_state ? near : all;
            state->step = static_cast<std::uint64_t>(step);
            keep_start(model, *state, context);
            context.instruments[0].command = {insertion, 0.5 * step * advance / 1e-3};
            const double share = wave_at(0.2, 0.01 * (step + 1));
            for (std::size_t v = 0; v < state->bodies[1].surface.size(); ++v)
                state->bodies[1].surface[v] = model.bodies[1].surface.vertices[v] + share * 0.1 * Vec3(2e-3, 1e-3, 4e-3);
            follow_wall(model, 1, *state, context);
            solve_instrument(model, 0, *state, context);
        }
        solve_between_walls(model, 0, near_state, near, budget);
        plane_from_walls(model, 0, all_state, all, kPlaneReach);
        solve_instrument(model, 0, all_state, all);
        for (std::size_t node = 0; node < all_state.instruments[0].rod.position.size(); ++node)
            EXPECT_EQ(near_state.instruments[0].rod.position[node], all_state.instruments[0].rod.position[node])
                << "step " << step << ", node " << node;
        if (::testing::Test::HasFailure()) return course;
        EXPECT_EQ(pokes_into_wall(model, 0, near_state, near), pokes_into_wall(model, 0, all_state, all)) << step;
        course.planes_short += near.instruments[0].planes.size();
        course.planes_all += all.instruments[0].planes.size();
        for (const fem::RodPlane& plane : all.instruments[0].planes) course.presses += plane.force > 0.0;
    }
    return course;
}

TEST(PlaneReach, SlowMotionNeedsFewerPlanesForTheSameSolve) {
    const Course slow = push_through_the_bend(2e-5, 2000);
    EXPECT_GT(slow.presses, 100u) << "it pressed on the wall";
    EXPECT_LT(slow.planes_short, slow.planes_all / 2);
}

TEST(PlaneReach, FastMotionGetsThemAll) {
    const Course fast = push_through_the_bend(9e-4, 100);
    EXPECT_GT(fast.presses, 100u) << "it pressed on the wall";
}

} // namespace
} // namespace seldinger::engine
