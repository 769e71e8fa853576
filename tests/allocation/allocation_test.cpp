// The step loop allocates nothing once it is warm: every allocation of the program passes a counter here.
#include "../engine/step_fixture.hpp"

#include "collision/culling/cull_twin.hpp"
#include "engine/render/attach_culler.hpp"
#include "engine/fluoroscopy/patient.hpp"
#include "engine/viewer/latest.hpp"
#include "engine/viewer/snapshot.hpp"

#include <atomic>
#include <cstdlib>
#include <execinfo.h>
#include <new>

namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> count{0};
void* first_places[24];
int first_depth = 0;

void* allocate(std::size_t size, std::size_t alignment) {
    if (counting.load(std::memory_order_relaxed) && count.fetch_add(1) == 0) {
        counting = false; // what backtrace allocates for itself is not the step's
        first_depth = backtrace(first_places, 24);
        counting = true;
    }
    void* memory = alignment > alignof(std::max_align_t) ? std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)
                                                         : std::malloc(size == 0 ? 1 : size);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

} // namespace

void* operator new(std::size_t size) { return allocate(size, 0); }
void* operator new[](std::size_t size) { return allocate(size, 0); }
void* operator new(std::size_t size, std::align_val_t alignment) { return allocate(size, static_cast<std::size_t>(alignment)); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return allocate(size, static_cast<std::size_t>(alignment)); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return allocate(size, 0); } // std::stable_sort's buffer
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return allocate(size, 0); }
// gcc pairs free with the inlined malloc above and takes the replaced operators for the library's
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace trocar::engine {
namespace {

constexpr const char* kAllEffects = R"("elasticity", "damping", "coarse_contact", "exact_contact", "friction")";

struct Case {
    std::string name;
    test::BentTube tube;
};
void PrintTo(const Case& tested, std::ostream* os) { *os << tested.name; }

class StepLoop : public ::testing::TestWithParam<Case> {};

void expect_no_allocation(Simulator& simulator) {
    std::uint64_t steps_that_did = 0, all = 0;
    for (int k = 0; k < 100; ++k) {
        count = 0;
        counting = true;
        const StepReport& report = simulator.step();
        counting = false;
        ASSERT_TRUE(report.finite) << report.failure;
        steps_that_did += count > 0;
        all += count;
    }
    EXPECT_EQ(all, 0u) << steps_that_did << " of 100 steps allocated; the last first allocation came from:";
    if (all > 0) backtrace_symbols_fd(first_places, first_depth, 2);
}

TEST_P(StepLoop, AllocatesNothingOnceWarm) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene(GetParam().tube));
    ASSERT_EQ(prepared.model.instruments.size(), 1u);
    Simulator simulator(prepared.model);
    (void)test::run_steps(simulator, 50);
    expect_no_allocation(simulator);
}

INSTANTIATE_TEST_SUITE_P(, StepLoop,
                         ::testing::Values(Case{"WithAStaticTube", {35, "exact", R"("coarse_contact", "exact_contact", "friction")", ""}},
                                           Case{"WithSpheresAlone", {35, "exact", R"("coarse_contact")", ""}},
                                           Case{"UnderAWorkBudget",
                                                {35, "work:500", R"("coarse_contact", "exact_contact", "friction")", ""}},
                                           Case{"WithTissue", {35, "exact", kAllEffects, test::kOrgan}},
                                           Case{"WithImplicitTissue", {35, "exact", kAllEffects, test::kOrgan, "implicit"}}),
                         [](const ::testing::TestParamInfo<Case>& tested) { return tested.param.name; });

/// An effect that remembers.
TEST(Contrast, AllocatesNothingOnceWarm) {
    std::string text = test::bent_tube_scene();
    const std::string list = R"(["coarse_contact", "exact_contact", "friction"])";
    ASSERT_NE(text.find(list), std::string::npos);
    text.replace(text.find(list), list.size(), R"({"coarse_contact": true, "exact_contact": true, "contrast": {"rate": 2, "speed": 100, "duration": 2}})");
    const PreparedScene prepared = test::prepare(text);
    ASSERT_EQ(prepared.model.effects.added.size(), 1u);
    Simulator simulator(prepared.model);
    (void)test::run_steps(simulator, 50);
    expect_no_allocation(simulator);
}

/// A wire that is pushed out of a catheter and turned, both with torsional wind-up: the chain of both grows during the test.
TEST(WireInACatheter, AllocatesNothingOnceWarm) {
    for (const char* bore : {"", R"("inner_radius": 0.5, )"}) { // on one axis, and with play
    const PreparedScene prepared = test::prepare(fmt::format(R"({{
        "name": "pair", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 4}},
        "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [{}], "sides": 20}}}}}},
        "instruments": {{
            "catheter": {{"length": 200, "radius": 0.8, {} "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500, "lumen": "tube",
                "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}}, "path": [[0, 30, 0], [4, 60, 3]]}},
            "wire": {{"inside": "catheter", "length": 260, "radius": 0.3, "young_modulus": 200000, "segment": 2, "skin_triangles": 1500,
                "path": [[0, 20, 0], [4, 130, -3]]}}}},
        "effects": ["coarse_contact", "exact_contact", "friction", "twist"]}})",
                                                             test::bent_axis(25.0, 3.0), bore));
    Simulator simulator(prepared.model);
    (void)test::run_steps(simulator, 50);
    expect_no_allocation(simulator);
    }
}

/// Tested contacts of a ball that has settled, and pairs that a small budget leaves open.
TEST(Solids, AllocateNothingOnceWarm) {
    for (const auto& [budget, warm] : {std::pair{"exact", 600}, std::pair{"work:200", 600}}) {
        SCOPED_TRACE(budget);
        const PreparedScene prepared = test::prepare(fmt::format(R"({{
            "name": "ball", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 4}},
            "gravity": [0, 0, -9810], "budget": "{}", "contact": {{"solid_friction": 0.3}},
            "bodies": {{
                "ball": {{"kind": "deformable", "surface": {{"shape": "sphere", "centre": [0, 0, 32], "radius": 30, "subdivisions": 2}},
                    "material": {{"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "mass_damping": 3}}, "coarse": {{"surface_triangles": 80}}}},
                "table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, -5], "extent": [200, 200, 10], "cells": 8}}}}}},
            "effects": ["elasticity", "gravity", "damping", "coarse_contact"]}})",
                                                                 budget));
        Simulator simulator(prepared.model);
        (void)test::run_steps(simulator, warm);
        const StepReport& report = simulator.report();
        EXPECT_GT(report.solid_touches + report.held_pairs, 0u) << "they touch";
        expect_no_allocation(simulator);
    }
}

/// A beam that rocks on a wall across it: edges on edges, which come and go.
TEST(Solids, WhereEdgesCrossAllocateNothingOnceWarm) {
    const PreparedScene prepared = test::prepare(R"({
        "name": "beam", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 4}, "gravity": [0, 0, -9810],
        "bodies": {
            "beam": {"kind": "deformable", "surface": {"shape": "box", "centre": [4, 3, 12], "extent": [100, 20, 20], "cells": 1},
                "material": {"young_modulus": 200, "poisson_ratio": 0.3, "density": 1000}, "coarse": {"surface_triangles": 150}},
            "wall": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -20], "extent": [30, 200, 40], "cells": 1}}},
        "effects": ["elasticity", "gravity", "coarse_contact"]})");
    Simulator simulator(prepared.model);
    (void)test::run_steps(simulator, 100);
    expect_no_allocation(simulator);
    const auto& contacts = simulator.state().solids.contacts;
    EXPECT_TRUE(std::any_of(contacts.begin(), contacts.end(), [](const SolidContact& c) { return c.touch.between_edges(); }));
}

/// User input, a pull at the tissue, a viewer's snapshot, the X-ray monitor's state: between two steps nothing is allocated either.
TEST(ViewerSession, AllocatesNothingOnceWarm) {
    const test::BentTube tube{35, "work:20000", kAllEffects, test::kOrgan};
    Result<Scene> scene = parse_scene(test::bent_tube_scene(tube), "scenes/viewer.json");
    ASSERT_TRUE(scene.ok());
    const PreparedScene prepared = test::prepare(test::bent_tube_scene(tube));
    viewer::Session session(*scene, prepared);
    viewer::Latest<viewer::Snapshot> latest;
    for (viewer::Snapshot& place : latest.places()) viewer::prepare_snapshot(session, place);
    State xray = visible_part(session.simulator().state());
    const auto turn = [&](int k) {
        session.apply(viewer::Drive{k % 40 < 30 ? 1.0 : -0.5, 0.4});
        session.apply(viewer::Grab{0, 0, Vec3(0.0, 0.0, 0.05)});
        session.step();
        viewer::fill_snapshot(session, true, latest.back());
        latest.publish();
        (void)latest.take();
        update_visible_part(session.model(), session.simulator().state(), xray);
    };
    for (int k = 0; k < 50; ++k) turn(k);
    count = 0;
    counting = true;
    for (int k = 50; k < 150; ++k) turn(k);
    counting = false;
    ASSERT_FALSE(session.stopped());
    EXPECT_EQ(count, 0u) << "the first came from:";
    if (count > 0) backtrace_symbols_fd(first_places, first_depth, 2);
}

/// Allocations of every step from the first one on; what a step does before it is warm is in there.
struct Steps {
    std::vector<std::uint64_t> allocations;
    std::uint64_t looked_at = 0;
};
Steps count_from_the_start(Simulator& simulator, int steps) {
    Steps result;
    result.allocations.reserve(static_cast<std::size_t>(steps));
    for (int k = 0; k < steps; ++k) {
        count = 0;
        counting = true;
        const StepReport& report = simulator.step();
        counting = false;
        EXPECT_TRUE(report.finite) << report.failure;
        result.allocations.push_back(count);
        result.looked_at += report.cull_items;
    }
    return result;
}

/// The CPU reference on the thread of a device.
class CpuReferenceAsDevice final : public collision::CullBackend {
public:
    [[nodiscard]] std::string name() const override { return "a device for tests"; }
    [[nodiscard]] int preferred_resolution() const noexcept override { return 64; }
    void reserve(std::size_t prisms, std::size_t questions, int resolution) override { twin_.reserve(prisms, questions, resolution); }
    [[nodiscard]] Result<void> find_hits(const collision::CullJob& job, std::span<std::uint8_t> hits) override {
        return twin_.find_hits(job, hits);
    }

private:
    collision::CpuCullBackend twin_;
};

/// Stage II: in no step, the first included, does culling allocate anything that the same step does not allocate without it.
TEST(ImageSpaceCulling, AllocatesNothingInAnyStep) {
    const auto prepare = [](Culling culling) {
        PreparedScene prepared = test::prepare(test::bent_tube_scene({.budget = "exact"}));
        prepared.model.contact.culling = culling;
        prepared.model.contact.clearance = 1e-3;
        prepared.model.contact.exact_distance = 0.9e-3;
        return prepared;
    };
    constexpr int kSteps = 40;
    const PreparedScene never = prepare(Culling::Never), cpu = prepare(Culling::Cpu), device = prepare(Culling::OpenGl);
    Simulator without(never.model), by_cpu_reference(cpu.model), by_device(device.model), by_opengl(device.model);
    by_device.set_cull_device(std::make_unique<CpuReferenceAsDevice>());
    const Steps plain = count_from_the_start(without, kSteps);
    EXPECT_EQ(plain.looked_at, 0u);
    for (Simulator* simulator : {&by_cpu_reference, &by_device}) {
        const Steps culled = count_from_the_start(*simulator, kSteps);
        EXPECT_GT(culled.looked_at, 0u);
        EXPECT_EQ(culled.allocations, plain.allocations);
    }
    const std::string words = attach_culler(by_opengl);
    std::printf("%s\n", words.c_str());
    const Steps drawn = count_from_the_start(by_opengl, kSteps);
    EXPECT_GT(drawn.looked_at, 0u);
    EXPECT_EQ(drawn.allocations, plain.allocations); // the driver's own memory passes no counter
}

TEST(Counter, SeesAnAllocation) {
    count = 0;
    counting = true;
    std::vector<int> numbers(100);
    numbers[3] = 1;
    counting = false;
    EXPECT_GE(count, 1u);
    EXPECT_EQ(numbers[3], 1);
}

} // namespace
} // namespace trocar::engine
