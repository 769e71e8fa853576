// Inputs of a program to the simulator: refused with a sentence, or applied; a refused one has changed nothing, and no
// state is ever anything but finite.
#include "engine/effects/registry.hpp"
#include "engine/prepare/check_scene.hpp"
#include "engine/step/entry_checks.hpp"
#include "step_fixture.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <random>

namespace trocar::engine {
namespace {

using testing::HasSubstr;

constexpr double kInf = std::numeric_limits<double>::infinity();
const double kNan = std::nan("");

/// Unlikely values among likely ones.
class Hostile {
public:
    explicit Hostile(std::uint64_t seed) : random_(seed) {}
    double number() {
        const double odd[] = {kNan, kInf, -kInf, 1e308, -1e308, 5e-324, 0.0, -0.0};
        if (below(2) == 0) return odd[below(std::size(odd))];
        return std::uniform_real_distribution<double>(-0.2, 0.2)(random_);
    }
    std::size_t index(std::size_t count) {
        const std::size_t odd[] = {count, count + 1, SIZE_MAX, SIZE_MAX / 2, std::size_t{1} << 32};
        return below(2) == 0 && count > 0 ? below(count) : odd[below(std::size(odd))];
    }
    BudgetLimits limits() {
        const std::uint64_t work[] = {0, 1, 300, UINT64_MAX};
        return {static_cast<BudgetMode>(below(5)), number(), work[below(std::size(work))]};
    }
    std::size_t below(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_); }

private:
    std::mt19937_64 random_;
};

/// One command, for that instrument.
Inputs driven(const SceneModel& model, std::size_t instrument, const DriveCommand& wanted) {
    Inputs inputs;
    inputs.drive.resize(std::max(model.instruments.size(), std::min<std::size_t>(instrument, 1000) + 1));
    inputs.drive[std::min<std::size_t>(instrument, 1000)] = wanted;
    return inputs;
}

bool is_finite_state(const State& state) { return test::all_finite(state); }

const PreparedScene& organ_scene() {
    static const PreparedScene prepared = test::prepare(test::bent_tube_scene(
        {.budget = "work:2000", .effects = R"("elasticity", "damping", "coarse_contact", "exact_contact")", .host_body = test::kOrgan}));
    return prepared;
}

TEST(Entries, ADriveCommandThatIsNotFiniteOrOfNoInstrumentIsRefusedWithASentence) {
    Simulator simulator(organ_scene().model);
    for (const double bad : {kNan, kInf, -kInf}) {
        const auto insertion = simulator.step(driven(simulator.model(), 0, {bad, 0.0}));
        const auto rotation = simulator.step(driven(simulator.model(), 0, {0.03, bad}));
        ASSERT_FALSE(insertion.ok());
        ASSERT_FALSE(rotation.ok());
        EXPECT_THAT(insertion.error().to_string(), HasSubstr("insertion: found "));
        EXPECT_THAT(rotation.error().to_string(), HasSubstr("rotation: found "));
        EXPECT_THAT(rotation.error().to_string(), HasSubstr("expected a finite number"));
    }
    for (const std::size_t nobody : {std::size_t{1}, std::size_t{1000}, SIZE_MAX}) {
        const auto set = simulator.step(driven(simulator.model(), nobody, {0.03, 0.0}));
        ASSERT_FALSE(set.ok());
        EXPECT_THAT(set.error().message, HasSubstr("expected none, or one for each of 1 instruments"));
        EXPECT_FALSE(simulator.follow_route(nobody).has_value());
    }
    EXPECT_EQ(simulator.state().step, 0u) << "what is refused takes no step";
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(simulator.step(driven(simulator.model(), 0, {1e308, -1e308})).ok()) << "the limits of the drive bound it";
        ASSERT_TRUE(simulator.report().finite);
    }
    EXPECT_TRUE(is_finite_state(simulator.state()));
}

/// Two simulators: one is given all inputs, the other only those that the first one accepted.
TEST(Entries, WhatIsRefusedHasChangedNothingAndEveryStateIsFinite) {
    const SceneModel& model = organ_scene().model;
    std::size_t refused = 0, taken = 0;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        Hostile hostile(seed);
        Simulator told(model), twin(model);
        const auto count = [&](bool ok) { ok ? ++taken : ++refused; };
        for (int k = 0; k < 40; ++k) {
            Inputs accepted;
            accepted.drive.resize(model.instruments.size());
            const DriveCommand wanted{hostile.number(), hostile.number()};
            const std::size_t instrument = hostile.index(model.instruments.size());
            const auto driving = told.check_inputs(driven(model, instrument, wanted));
            count(driving.ok());
            if (driving.ok()) {
                accepted.drive[instrument] = wanted;
            } else {
                EXPECT_THAT(driving.error().message, HasSubstr("found "));
            }
            const auto offer = [&](auto&& change) {
                Inputs more = accepted;
                change(more);
                const bool fine = told.check_inputs(more).ok();
                count(fine);
                if (!fine) {
                    EXPECT_FALSE(told.begin_step(more)) << "it does not begin";
                    EXPECT_FALSE(told.step(more).ok());
                    return;
                }
                accepted = more;
            };
            offer([&](Inputs& inputs) {
                Pull pull;
                pull.body = hostile.index(model.bodies.size());
                const std::size_t vertices = pull.body < model.bodies.size() ? model.bodies[pull.body].surface.vertices.size() : 7;
                pull.vertex = static_cast<Index>(hostile.index(vertices));
                pull.target = Vec3(hostile.number(), hostile.number(), hostile.number());
                inputs.pull = pull;
            });
            offer([&](Inputs& inputs) {
                inputs.budget = hostile.limits();
                if (inputs.budget->mode == BudgetMode::Wall) inputs.budget->wall_s = kNan; // a clock must not decide this test
            });
            offer([&](Inputs& inputs) { inputs.live.set(effects::breathing, hostile.number()); });
            offer([&](Inputs& inputs) { inputs.live.set(effects::twist, hostile.number()); }); // is fixed for a run
            offer([&](Inputs& inputs) {
                for (const EffectDescriptor* effect : {&effects::elasticity, &effects::coarse_contact, &effects::exact_contact})
                    inputs.live.set(*effect, hostile.below(4) != 0 ? 1.0 : 0.0);
            });
            told.set_cull_device(nullptr);
            (void)told.finish_step(); // of no step: nothing
            if (hostile.below(2) == 0) (void)told.begin_step(accepted);
            (void)told.begin_step(accepted); // once more: nothing
            if (hostile.below(4) == 0) { // a step that has begun is given up
                ASSERT_TRUE(told.restore(twin.state()).ok());
            }
            (void)told.begin_step(accepted);
            const StepReport& report = told.finish_step();
            ASSERT_TRUE(report.finite) << report.failure;
            ASSERT_TRUE(twin.step(accepted).ok());
            ASSERT_TRUE(twin.report().finite);
            ASSERT_TRUE(is_finite_state(told.state())) << "seed " << seed << ", step " << k;
        }
        EXPECT_EQ(hash_state(told.state()), hash_state(twin.state())) << "seed " << seed;
    }
    EXPECT_GT(refused, 100u);
    EXPECT_GT(taken, 50u);
}

TEST(Entries, AModelOrABudgetThatNoStepCanBeTakenWithStopsBeforeTheFirstOne) {
    const auto refusal = [](const SceneModel& model, const BudgetLimits& limits) {
        Simulator simulator(model, limits);
        const std::uint64_t before = hash_state(simulator.state());
        EXPECT_FALSE(simulator.begin_step());
        const StepReport report = simulator.step();
        EXPECT_FALSE(report.finite);
        EXPECT_EQ(hash_state(simulator.state()), before);
        return report.failure;
    };
    const SceneModel& good = organ_scene().model;
    for (const double bad : {kNan, kInf, -1.0, 1e9})
        EXPECT_THAT(refusal(good, {BudgetMode::Wall, bad, 0}), HasSubstr("budget.wall_s: found "));
    EXPECT_THAT(refusal(good, {static_cast<BudgetMode>(9), 0.0, 0}), HasSubstr("budget.mode: found 9"));
    SceneModel model = good;
    for (const double bad : {kNan, kInf, 0.0, -0.01}) {
        model.step_s = bad;
        EXPECT_THAT(refusal(model, good.budget), HasSubstr("step_s: found "));
    }
    model = good;
    model.effects.gravity = Vec3(0.0, kNan, 0.0);
    EXPECT_THAT(refusal(model, good.budget), HasSubstr("gravity: found nan, expected three finite numbers"));
    model = good;
    model.contact.rod_stiffness = kNan;
    EXPECT_THAT(refusal(model, good.budget), HasSubstr("contact.rod_stiffness"));
    model = good;
    model.instruments[0].limits.speed = kNan;
    EXPECT_THAT(refusal(model, good.budget), HasSubstr("limits.speed"));
}

TEST(Entries, AStateOfAModelOfAnotherSizeIsNotTaken) {
    const PreparedScene tube = test::prepare(test::bent_tube_scene({.budget = "work:2000"}));
    Simulator a(organ_scene().model), b(tube.model);
    const auto restored = b.restore(a.state());
    ASSERT_FALSE(restored.ok());
    EXPECT_THAT(restored.error().message, HasSubstr("bodies: found 2, expected 1"));
    EXPECT_TRUE(b.step().finite) << "it goes on by itself";
}

TEST(Entries, AStateGoesOnInTimeUnderStepsOfAnotherLength) {
    const PreparedScene tube = test::prepare(test::bent_tube_scene({.budget = "work:2000"}));
    SceneModel slower = tube.model;
    slower.step_s = 0.5 * tube.model.step_s;
    Simulator a(tube.model), b(slower);
    ASSERT_EQ(test::run_steps(a, 30).steps, 30u);
    ASSERT_TRUE(b.restore(a.state()).ok());
    for (int k = 1; k <= 8; ++k) {
        ASSERT_TRUE(b.step().finite);
        EXPECT_NEAR(b.state().time, 30 * tube.model.step_s + k * slower.step_s, 1e-12);
        EXPECT_EQ(b.report().time_s, b.state().time);
    }
    EXPECT_NEAR(b.state().instruments[0].rod.insertion, evaluate_path(slower.instruments[0].path, b.state().time).insertion, 1e-6) << "as its path says";
}

/// One number of a scene that a program has made, set to something.
struct SceneEdit {
    const char* what;
    void (*apply)(Scene&, double);
};
const SceneEdit kEdits[] = {
    {"time.step", [](Scene& s, double x) { s.time.step = x; }},
    {"time.duration", [](Scene& s, double x) { s.time.duration = x; }},
    {"contact.clearance", [](Scene& s, double x) { s.contact.clearance = x; }},
    {"contact.rod_stiffness", [](Scene& s, double x) { s.contact.rod_stiffness = x; }},
    {"gravity", [](Scene& s, double x) { s.gravity = Vec3(0.0, x, 0.0); }},
    {"bodies.organ.material.young_modulus", [](Scene& s, double x) { s.bodies[0].material.young_modulus = x; }},
    {"bodies.organ.scale", [](Scene& s, double x) { s.bodies[0].scale = x; }},
    {"bodies.organ.translate", [](Scene& s, double x) { s.bodies[0].translate = Vec3(x, 0.0, 0.0); }},
    {"bodies.organ.surface.extent", [](Scene& s, double x) { s.bodies[0].surface.shape.extent[1] = x; }},
    {"bodies.organ.fixed", [](Scene& s, double x) { s.bodies[0].fixed[0].region.fraction = x; }},
    {"bodies.tube.surface.axis", [](Scene& s, double x) { s.bodies[1].surface.shape.axis_radii[1] = x; }},
    {"bodies.tube.blend", [](Scene& s, double x) { s.bodies[1].blend = x; }},
    {"instruments.wire.entry", [](Scene& s, double x) { s.instruments[0].entry.position[2] = x; }},
    {"instruments.wire.direction", [](Scene& s, double x) { s.instruments[0].entry.direction = Vec3(x, x, x); }},
    {"instruments.wire.length", [](Scene& s, double x) { s.instruments[0].design.length = x; }},
    {"instruments.wire.radius", [](Scene& s, double x) { s.instruments[0].design.radius = x; }},
    {"instruments.wire.path", [](Scene& s, double x) { s.instruments[0].path[1].insertion = x; }},
    {"instruments.wire.speed", [](Scene& s, double x) { s.instruments[0].limits.speed = x; }},
};

/// The second body of the scene's list is the tube.
Scene written_scene() {
    auto good =
        parse_scene(test::bent_tube_scene({.budget = "work:300", .effects = R"("elasticity", "coarse_contact")", .host_body = test::kOrgan}),
                    "scenes/own.json");
    EXPECT_TRUE(good.ok()) << good.error().to_string();
    return std::move(*good);
}

TEST(Entries, ASceneThatAProgramHasWrittenIsCheckedAsOneThatWasRead) {
    const Scene good = written_scene();
    ASSERT_TRUE(check_scene(good).ok()) << check_scene(good).error().to_string();
    for (const SceneEdit& edit : kEdits)
        for (const double bad : {kNan, kInf, -kInf, -1e300}) {
            Scene scene = good;
            edit.apply(scene, bad);
            const auto prepared = make_prepared_scene(scene);
            EXPECT_FALSE(prepared.ok()) << edit.what << " = " << bad;
            if (!prepared.ok()) {
                EXPECT_FALSE(prepared.error().message.empty());
            }
        }
    const auto refuses = [&](auto change) {
        Scene scene = good;
        change(scene);
        return !make_prepared_scene(scene).ok();
    };
    for (const Index bad : {Index{2}, Index{1000}, kNoIndex - 1}) {
        EXPECT_TRUE(refuses([bad](Scene& s) { s.instruments[0].lumen = bad; })) << bad;
        EXPECT_TRUE(refuses([bad](Scene& s) { s.instruments[0].inside = bad; })) << bad;
        EXPECT_TRUE(refuses([bad](Scene& s) { s.bodies[1].embedded_in = bad; })) << bad;
        EXPECT_TRUE(refuses([bad](Scene& s) {
            s.instruments[0].path.clear();
            s.instruments[0].follow.emplace().target = bad;
        })) << bad;
    }
    EXPECT_TRUE(refuses([](Scene& s) { s.instruments[0].lumen = 0; })) << "a body that is not hollow";
    EXPECT_TRUE(refuses([](Scene& s) { s.bodies[1].embedded_in = 1; })) << "itself";
    EXPECT_TRUE(refuses([](Scene& s) { s.bodies[0].surface.shape.cells = 1 << 30; }));
    EXPECT_TRUE(refuses([](Scene& s) { s.bodies[1].surface.shape.axis_radii.pop_back(); }));
}

TEST(Entries, AChangedSceneIsRefusedByKeyValueAndTheRangeThatAFileHas) {
    const auto refusal = [good = written_scene()](auto change) {
        Scene scene = good;
        change(scene);
        const auto checked = check_scene(scene);
        return checked.ok() ? Error{} : checked.error();
    };
    const Error damping = refusal([](Scene& s) { s.contact.solid_damping = 2e6; });
    EXPECT_EQ(damping.key, "contact.solid_damping");
    EXPECT_EQ(damping.message, "found 2e+06, expected 0 to 1e+06");
    const Error density = refusal([](Scene& s) { s.bodies[0].material.density = 1.0; });
    EXPECT_EQ(density.key, "bodies.organ.material.density");
    EXPECT_EQ(density.message, "found 1, expected 50 to 23000 kg/m^3");
    EXPECT_EQ(refusal([](Scene& s) { s.instruments[0].limits.speed = 0.0; }).key, "instruments.wire.limits.speed");
    EXPECT_EQ(refusal([](Scene& s) { s.instruments[0].design.tip_angle = kNan; }).key, "instruments.wire.tip.angle");
    EXPECT_EQ(refusal([](Scene& s) { s.effects.breathing.emplace().direction = Vec3(0.0, 0.0, 2.0); }).key, "effects.breathing.direction");
    EXPECT_EQ(refusal([](Scene& s) { s.effects.blood_drag.emplace().blood.viscosity = 0.0; }).key, "effects.blood_drag.viscosity");
    EXPECT_EQ(refusal([](Scene& s) { s.cost.patch = 0.0; }).message, "") << "0 stands for the key left out";
}

TEST(Entries, BreathingThatIsFadedInFromNoneIsTaken) {
    SceneModel model = organ_scene().model;
    model.effects.breathing = BreathingSpec{.amplitude = 0.0};
    EXPECT_TRUE(check_settings(model).ok());
    model.effects.breathing->period = 0.0;
    EXPECT_EQ(check_settings(model).error().key, "breathing.period");
    model.effects.breathing = BreathingSpec{.amplitude = -0.01};
    EXPECT_EQ(check_settings(model).error().key, "breathing.amplitude");
}

} // namespace
} // namespace trocar::engine
