// The wall's bounds follow it, made anew where they are asked for: planes as from a refit of everything, to the bit.
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

TEST(FollowWall, PlanesAreThoseOfAWholeRefit) {
    const PreparedScene prepared = test::prepare(
        test::bent_tube_scene({.effects = R"("elasticity", "damping", "breathing", "coarse_contact")", .host_body = test::kOrgan}));
    SceneModel model = prepared.model;
    model.effects.coarse_contact = false; // no descent, so that nothing is proven free: planes everywhere
    ASSERT_TRUE(model.bodies[1].moves());
    State state = make_initial_state(model);
    fem::place_rod(model.instruments[0].rod, model.instruments[0].port, 0.035, 0.0, state.instruments[0].rod);
    StepScratch follows = make_scratch(prepared.model, state), whole = make_scratch(prepared.model, state);
    std::size_t planes = 0;
    for (int step = 0; step < 48; ++step, ++state.step) {
        for (StepScratch* context : {&follows, &whole}) {
            test::keep_whole_start(model, state, *context);
            context->rods.instruments[0].command = {0.035, 0.0};
        }
        // The tube goes to and fro by up to 0.7 mm a step, as whole as a breath and faster.
        const double share = wave_at(0.2, 0.01 * (step + 1));
        for (std::size_t v = 0; v < state.bodies[1].surface.size(); ++v)
            state.bodies[1].surface[v] = model.bodies[1].surface.vertices[v] + share * Vec3(2e-3, 1e-3, 4e-3);
        follow_wall(model, 1, state, follows.rods);
        whole.rods.walls[1].last_step = kNoStep; // everything
        follow_wall(model, 1, state, whole.rods);
        if (step % 5 == 3) continue; // nothing is asked for in some steps
        plane_from_wall(model, 0, state, follows.rods, kPlaneReach);
        const InstrumentState by_following = state.instruments[0];
        plane_from_wall(model, 0, state, whole.rods, kPlaneReach);
        expect_same_planes(by_following, state.instruments[0], step);
        planes += by_following.planes.size();
        EXPECT_EQ(penetrates_wall(model, 0, state, follows.rods), penetrates_wall(model, 0, state, whole.rods)) << "step " << step;
    }
    EXPECT_GT(planes, 500u);
}

/// A wall that jumps in a step that nobody followed is met where it is.
TEST(FollowWall, AStepThatWasMissedAsksForAWholeRefit) {
    const PreparedScene prepared =
        test::prepare(test::bent_tube_scene({.effects = R"("elasticity", "breathing", "coarse_contact")", .host_body = test::kOrgan}));
    const SceneModel& model = prepared.model;
    State state = make_initial_state(model);
    fem::place_rod(model.instruments[0].rod, model.instruments[0].port, 0.035, 0.0, state.instruments[0].rod);
    for (Vec3& p : state.instruments[0].rod.position) p += Vec3(0.0, 2.1e-3, 0.0); // beside the wall
    StepScratch context = make_scratch(model, state), anew = make_scratch(model, state);
    std::size_t planes = 0;
    for (const std::uint64_t step : {0, 1, 2, 7, 8}) {
        state.step = step;
        for (Vec3& v : state.bodies[1].surface) v += Vec3(step == 7 ? -1.5e-3 : 0.0, 0, 0); // before the step
        for (StepScratch* one : {&context, &anew}) test::keep_whole_start(model, state, *one), one->rods.instruments[0].command = {0.035, 0.0};
        for (Vec3& v : state.bodies[1].surface) v += Vec3(0.3e-3, 0, 0);
        anew.rods.walls[1].last_step = kNoStep;
        for (StepScratch* one : {&context, &anew}) follow_wall(model, 1, state, one->rods);
        EXPECT_NEAR(context.rods.walls[1].way, 0.3e-3, 1e-9);
        plane_from_wall(model, 0, state, context.rods, kPlaneReach);
        const InstrumentState followed = state.instruments[0];
        plane_from_wall(model, 0, state, anew.rods, kPlaneReach);
        expect_same_planes(followed, state.instruments[0], static_cast<int>(step));
        planes += followed.planes.size();
    }
    EXPECT_GT(planes, 50u);
}

/// The exact stage's contacts do not depend on how old the bounds elsewhere are: steps go on to the same bits when everything is made anew.
TEST(FollowWall, StepsEndTheSameAsWithBoundsMadeAnew) {
    for (const char* effects : {R"("elasticity", "breathing", "coarse_contact")", R"("elasticity", "breathing", "coarse_contact", "exact_contact")"}) {
        const PreparedScene prepared = test::prepare(test::bent_tube_scene({.effects = effects, .host_body = test::kOrgan}));
        Simulator follows(prepared.model), anew(prepared.model);
        for (int k = 0; k < 60; ++k) {
            (void)anew.restore(anew.state()); // forgets all bounds
            follows.step();
            anew.step();
            ASSERT_EQ(hash_state(follows.state()), hash_state(anew.state())) << effects << ", step " << k;
            ASSERT_EQ(follows.report().candidates, anew.report().candidates) << effects << ", step " << k;
        }
    }
}

} // namespace
} // namespace trocar::engine
