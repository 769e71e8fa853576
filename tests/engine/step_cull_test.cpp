// Stage II inside the engine's exact stage: with every back end the run is the same; the choice is reported.
#include "collision/culling/cull_twin.hpp"
#include "engine/render/attach_culler.hpp"
#include "engine/step/instrument/cull_stage.hpp"
#include "step_fixture.hpp"

#include <gmock/gmock.h>

#include <atomic>

namespace trocar::engine {
namespace {

constexpr std::uint64_t kSteps = 100;

struct Outcome {
    std::uint64_t hash = 0, items = 0, apart = 0, late = 0, left_out = 0, candidates = 0;
    unsigned by = 0;
    std::vector<std::uint64_t> units; // of every step
};

Outcome run(Simulator& simulator) {
    Outcome outcome;
    for (std::uint64_t k = 0; k < kSteps; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_TRUE(report.finite) << report.failure;
        EXPECT_EQ(report.lumen_exits, 0u);
        outcome.items += report.cull_items;
        outcome.apart += report.cull_apart;
        outcome.late += report.cull_late;
        outcome.left_out += report.cull_left_out;
        outcome.candidates += report.candidates;
        outcome.by = std::max(outcome.by, report.culled_by);
        outcome.units.push_back(report.work_units);
    }
    outcome.hash = hash_state(simulator.state());
    return outcome;
}

PreparedScene prepare(const std::string& budget, Culling culling) {
    PreparedScene prepared = test::prepare(test::bent_tube_scene({.budget = budget}));
    prepared.model.contact.culling = culling;
    prepared.model.contact.clearance = 1e-3; // many come near, and the planes of their faces do not tell all of them apart
    prepared.model.contact.exact_distance = 0.6e-3;
    return prepared;
}

/// The CPU reference on the thread of a device; slow, or lost after some views.
class TestDevice final : public collision::CullBackend {
public:
    std::atomic<int>* gate = nullptr; // views that succeed; nullptr: all
    int finds_until_lost = 1 << 30;
    std::int64_t pause_ns = 0; // of every find
    [[nodiscard]] std::string name() const override { return "a device for tests"; }
    [[nodiscard]] int preferred_resolution() const noexcept override { return 64; }
    [[nodiscard]] Result<void> find_hits(const collision::CullJob& job, std::span<std::uint8_t> hits) override {
        if (gate != nullptr) {
            gate->wait(0);
            --*gate;
        }
        if (pause_ns > 0) wait_until_ns(monotonic_ns() + pause_ns);
        if (--finds_until_lost < 0) return Error{ErrorCode::ToolFailed, "a device for tests: the context was lost"};
        return twin_.find_hits(job, hits);
    }

private:
    collision::CpuCullBackend twin_;
};

/// Views at the start: each probe twice, in three directions; nothing of it can be separated.
constexpr int kProbeFinds = 3 * 2 * static_cast<int>(std::size(kProbePairs));

TEST(CullStage, WhicheverBackendCullsTheRunHasTheSameBits) {
    const PreparedScene plain = prepare("exact", Culling::Never), automatic = prepare("exact", Culling::Auto),
                        twin = prepare("exact", Culling::Cpu), device = prepare("exact", Culling::OpenGl);
    Simulator without(plain.model), chosen(automatic.model), by_cpu_reference(twin.model), by_device(device.model);
    by_device.set_cull_device(std::make_unique<TestDevice>());
    const Outcome expected = run(without), a = run(chosen), t = run(by_cpu_reference), d = run(by_device);
    EXPECT_EQ(expected.by, 0u);
    EXPECT_EQ(a.hash, expected.hash);
    EXPECT_EQ(t.hash, expected.hash);
    EXPECT_EQ(d.hash, expected.hash);
    EXPECT_EQ(t.candidates, expected.candidates);
    EXPECT_EQ(t.by, static_cast<unsigned>(CulledBy::CpuReference));
    EXPECT_EQ(d.by, static_cast<unsigned>(CulledBy::Device));
    EXPECT_EQ(t.apart, d.apart); // without a clock every answer is waited for
    EXPECT_EQ(t.items, d.items);
    EXPECT_GT(t.apart, 0u) << "the planes of faces have told most pairs apart before anybody looks";
    std::printf("%llu of %llu candidates proven apart\n", static_cast<unsigned long long>(t.apart),
                static_cast<unsigned long long>(t.items));
}

TEST(CullStage, ByOpenGlTheSame) {
    const PreparedScene plain = prepare("exact", Culling::Cpu), prepared = prepare("exact", Culling::OpenGl);
    Simulator twin(plain.model), simulator(prepared.model);
    const std::string words = attach_culler(simulator);
    std::printf("%s\n", words.c_str());
    const Outcome expected = run(twin), outcome = run(simulator);
    EXPECT_EQ(outcome.hash, expected.hash);
    EXPECT_EQ(outcome.apart, expected.apart);
    const bool there = words.find("instead of OpenGL") == std::string::npos;
    EXPECT_EQ(outcome.by, static_cast<unsigned>(there ? CulledBy::Device : CulledBy::CpuReference));
    Simulator nothing(prepared.model);
    EXPECT_THAT(attach_culler(nothing, {.egl_library = "libNoSuchEgl.so.1", .osmesa_library = "libNoSuchMesa.so.8"}),
                ::testing::HasSubstr("CPU reference instead of OpenGL"));
}

TEST(CullStage, UnderABudgetOfWorkNoClockHasASay) {
    const PreparedScene twin = prepare("work:400000", Culling::Cpu), device = prepare("work:400000", Culling::OpenGl);
    Simulator first(twin.model), again(twin.model), other(device.model);
    other.set_cull_device(std::make_unique<TestDevice>());
    const Outcome a = run(first), b = run(again), c = run(other);
    EXPECT_EQ(a.hash, b.hash);
    EXPECT_EQ(a.hash, c.hash);
    EXPECT_EQ(a.units, b.units);
    EXPECT_EQ(a.units, c.units);
    EXPECT_EQ(a.apart, c.apart);
    EXPECT_GT(a.items, 0u);
    std::uint64_t left_out = 0; // a culling pass that does not fit the budget is left out, and reported
    for (const char* budget : {"work:4000", "work:6000", "work:9000", "work:14000", "work:20000"}) {
        const PreparedScene poor = prepare(budget, Culling::Cpu);
        Simulator tight(poor.model);
        left_out += run(tight).left_out;
    }
    EXPECT_GT(left_out, 0u);
}

TEST(CullStage, ALateAnswerIsDroppedAndNotWaitedFor) {
    const PreparedScene plain = prepare("1000s", Culling::Never), prepared = prepare("1000s", Culling::OpenGl);
    std::atomic<int> gate{kProbeFinds}; // those of its start, then the device never answers; outlives its thread
    Simulator without(plain.model), simulator(prepared.model);
    auto device = std::make_unique<TestDevice>();
    device->gate = &gate;
    simulator.set_cull_device(std::move(device));
    const Outcome expected = run(without), outcome = run(simulator);
    gate = 1 << 20; // lets the device's thread end
    gate.notify_all();
    EXPECT_EQ(outcome.hash, expected.hash);
    EXPECT_EQ(outcome.late, 1u);
    EXPECT_GT(outcome.left_out, 0u); // it was busy from then on
    EXPECT_EQ(outcome.apart, 0u);
    EXPECT_EQ(outcome.by, static_cast<unsigned>(CulledBy::Nobody));
}

TEST(CullStage, ALostDeviceIsReplacedByTheCpuReferenceAndReported) {
    const PreparedScene plain = prepare("exact", Culling::Cpu), prepared = prepare("exact", Culling::OpenGl);
    Simulator twin(plain.model), simulator(prepared.model);
    auto device = std::make_unique<TestDevice>();
    device->finds_until_lost = kProbeFinds + 20;
    simulator.set_cull_device(std::move(device));
    const Outcome expected = run(twin), outcome = run(simulator);
    EXPECT_EQ(outcome.hash, expected.hash);
    EXPECT_EQ(outcome.apart, expected.apart);
    ASSERT_EQ(simulator.cull_notes().size(), 1u);
    EXPECT_THAT(simulator.cull_notes()[0], ::testing::HasSubstr("context was lost"));
}

/// The cost of a culling pass is measured before the first step: a device that needs longer than the budget is not even tried, whatever the
/// declared rates say of it. Under a budget of work those alone count.
TEST(CullStage, ADeviceThatIsTooSlowIsKnownFromItsStart) {
    for (const bool slow : {true, false}) {
        const PreparedScene prepared = prepare(slow ? "40ms" : "1000s", Culling::OpenGl);
        Simulator simulator(prepared.model);
        auto device = std::make_unique<TestDevice>();
        device->pause_ns = slow ? 30'000'000 : 0; // three views take longer than a step may
        simulator.set_cull_device(std::move(device));
        const StepReport& first = simulator.step();
        unsigned late = first.cull_late, left_out = first.cull_left_out, by = first.culled_by;
        for (int k = 1; k < 30; ++k) {
            const StepReport& report = simulator.step();
            late += report.cull_late;
            left_out += report.cull_left_out;
            by = std::max(by, report.culled_by);
        }
        if (slow) {
            EXPECT_EQ(late, 0u) << "an answer that cannot come in time was waited for";
            EXPECT_GT(left_out, 0u);
            EXPECT_EQ(by, static_cast<unsigned>(CulledBy::Nobody));
        } else {
            EXPECT_GT(late + by, 0u) << "it was not tried"; // whether the answer came before the tests had ended depends on the scheduler
        }
    }
    const PreparedScene prepared = prepare("work:400000", Culling::OpenGl);
    Simulator fast(prepared.model), slow(prepared.model);
    auto device = std::make_unique<TestDevice>();
    device->pause_ns = 5'000'000;
    slow.set_cull_device(std::move(device));
    fast.set_cull_device(std::make_unique<TestDevice>());
    for (int k = 0; k < 10; ++k) {
        EXPECT_EQ(fast.step().culled_by, slow.step().culled_by);
    }
    EXPECT_EQ(hash_state(fast.state()), hash_state(slow.state()));
}

TEST(CullStage, AReplayOfAWallRunThatWasCulledHasItsBits) {
    const PreparedScene prepared = prepare("20ms", Culling::Cpu);
    std::vector<std::vector<Decision>> decisions(kSteps);
    Simulator simulator(prepared.model);
    bool looked = false;
    for (auto& step : decisions) {
        simulator.tape().record_into(&step);
        looked = simulator.step().culled_by > 0 || looked;
        for (const Decision& d : step) looked = looked || d == Decision{DecisionKind::Cull, 1};
    }
    EXPECT_TRUE(looked);
    Simulator again(prepared.model);
    for (const auto& step : decisions) {
        again.tape().replay(step);
        again.step();
        ASSERT_FALSE(again.tape().left_script());
    }
    EXPECT_EQ(hash_state(again.state()), hash_state(simulator.state()));
}

TEST(CullCost, CullsWhereThatIsPredictedToPay) {
    CullCostModel cost({.culling_s = 1e-3, .culling_s_per_item = 1e-6, .test_s_per_item = 1e-5, .dropped = 0.5});
    EXPECT_FALSE(cost.pays(0));
    EXPECT_FALSE(cost.pays(200)); // 1.2 ms against 1 ms
    EXPECT_TRUE(cost.pays(1000)); // 2 ms against 5 ms
    for (int k = 0; k < 20; ++k) {
        cost.note_culling(1000, 990, 2e-3); // it drops next to nothing
        cost.note_tests(990, 9.9e-3);
    }
    EXPECT_FALSE(cost.pays(1000));
    EXPECT_NEAR(cost.culling_s(1000), 2e-3, 1e-9);
    int steps = 0;
    for (; !cost.pays(1000) && steps < 1000; ++steps) cost.pass_over();
    EXPECT_GT(steps, 5); // tried again, not at once
    EXPECT_LT(steps, 1000);
}

TEST(CullCost, ALineThroughMeasurementsTellsStartAndSlope) {
    LineFit fit;
    for (int k = 0; k < 200; ++k) {
        const double x = 100.0 * (1 + k % 7);
        fit.add(x, 3e-3 + 2e-6 * x);
    }
    EXPECT_NEAR(fit.at(0.0), 3e-3, 1e-8);
    EXPECT_NEAR(fit.at(2000.0), 7e-3, 1e-7);
    LineFit one;
    one.add(50.0, 1e-3);
    EXPECT_NEAR(one.at(100.0), 2e-3, 1e-9);
}

} // namespace
} // namespace trocar::engine
