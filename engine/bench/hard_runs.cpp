// Whole runs: the same bits from launch to launch, on any number of threads, with every short cut off; budgets that jump.
#include "engine/bench/hard_scenes.hpp"
#include "engine/step/checkpoint.hpp"

#include <algorithm>
#include <set>

namespace seldinger::engine {

namespace {

constexpr std::uint64_t kSteps = 60;

/// Hash of the state after kSteps; 0 where the scene is refused or the run stopped.
std::uint64_t run_and_hash(HardReport& report, const SceneModel& model) {
    Simulator simulator(model);
    for (std::uint64_t k = 0; k < kSteps; ++k)
        if (!report.require(simulator.step().finite, "every step is finite")) return 0;
    return hash_state(simulator.state());
}

void ten_launches(HardReport& report) {
    for (const std::string& text : {organ_scene("work:20000"), solid_scene({.bodies = heap_bodies(4), .budget = "work:500"})}) {
        std::set<std::uint64_t> hashes;
        std::string name;
        for (int launch = 0; launch < 10; ++launch) {
            const auto prepared = prepare_hard_scene(report, text); // afresh: preparation belongs to a launch
            if (!prepared) return;
            name = prepared->model.name;
            hashes.insert(run_and_hash(report, prepared->model));
        }
        report.equal(name + ", ten launches under a budget of work: different final states", static_cast<double>(hashes.size()), 1);
    }
}

void threads_change_no_bit(HardReport& report) {
    const auto prepared = prepare_hard_scene(report, organ_scene("work:20000"));
    if (!prepared) return;
    const fem::TissueModel& tissue = *prepared->model.bodies[0].tissue;
    const BodyModel& tube = prepared->model.bodies[1];
    std::set<std::uint64_t> hashes;
    for (const unsigned threads : {1u, 2u, 3u, 8u}) {
        State state = make_initial_state(prepared->model);
        fem::RkWorkspace rk{.threads = threads};
        fem::StableStepWorkspace stable{.threads = threads};
        fem::LinkFrames frames{.threads = threads};
        for (int frame = 0; frame < 20; ++frame) {
            const auto done =
                fem::advance(tissue, state.bodies[0].tissue, 0.01, {.gravity = Vec3(0.0, -9.81, 0.0)}, {.max_substeps = 5000}, rk, stable);
            if (!report.require(done.integrate.finite() && !done.refused, "finite and not refused")) return;
            (void)fem::steer(*tube.links, state.bodies[0].tissue.position, tube.surface.vertices, frames, state.bodies[1].surface);
        }
        hashes.insert(hash_state(state));
    }
    report.equal("tissue and links on 1, 2, 3 and 8 threads: different final states", static_cast<double>(hashes.size()), 1);
}

void short_cuts_change_no_contact(HardReport& report) {
    // Under `exact` nothing is left to a budget: whatever spares work must leave the answer alone.
    const auto prepared = prepare_hard_scene(report, organ_scene("exact"));
    if (!prepared) return;
    std::set<std::uint64_t> hashes;
    std::size_t ways = 0;
    for (const Culling culling : {Culling::Never, Culling::Cpu, Culling::Auto}) {
        SceneModel model = prepared->model;
        model.contact.culling = culling;
        hashes.insert(run_and_hash(report, model));
        ++ways;
    }
    report.equal(fmt::format("wire in an organ, {} ways to cull: different final states", ways), static_cast<double>(hashes.size()), 1);
    hashes.clear();
    for (const char* order : {"breadth", "deepest", "depth"}) {
        const auto heap =
            prepare_hard_scene(report, solid_scene({.bodies = heap_bodies(5), .contact = fmt::format(R"("descent_order": "{}")", order)}));
        if (!heap) return;
        hashes.insert(run_and_hash(report, heap->model));
    }
    report.equal("five balls, three orders of the descent, no budget: different final states", static_cast<double>(hashes.size()), 1);
}

void resumed_run_is_the_same(HardReport& report) {
    const auto prepared = prepare_hard_scene(report, organ_scene("work:20000"));
    if (!prepared) return;
    const std::uint64_t whole = run_and_hash(report, prepared->model);
    int differing = 0;
    Simulator first(prepared->model);
    for (const std::uint64_t cut : {1u, 7u, 31u, 59u}) {
        while (first.state().step < cut) (void)first.step();
        Simulator later(prepared->model);
        const auto checkpoint = parse_checkpoint(checkpoint_bytes(make_checkpoint(first)), "memory");
        if (!report.require(checkpoint.ok() && resume(later, *checkpoint, "memory").ok(), "the checkpoint is taken over")) return;
        while (later.state().step < kSteps) (void)later.step();
        differing += hash_state(later.state()) != whole;
    }
    report.equal("a run cut after 1, 7, 31 and 59 steps and resumed: final states that differ", differing, 0);
}

void a_budget_that_jumps_pumps_no_energy(HardReport& report) {
    const auto prepared = prepare_hard_scene(
        report,
        solid_scene({.bodies = soft_body("ball", R"({"shape": "sphere", "centre": [0, 0, 38], "radius": 30, "subdivisions": 3})")}));
    if (!prepared) return;
    for (const bool wall : {false, true}) {
        Simulator simulator(prepared->model);
        double first = 0.0, most = 0.0;
        for (std::uint64_t k = 0; k < 400; ++k) {
            const bool tight = k % 2 == 0;
            simulator.set_budget(wall ? BudgetLimits{BudgetMode::Wall, tight ? 1e-4 : 1e-2, 0}
                                      : BudgetLimits{BudgetMode::Work, 0.0, tight ? std::uint64_t{9} : std::uint64_t{1'000'000}});
            if (!report.require(simulator.step().finite, "every step is finite")) return;
            if (k == 0) first = energy_of(simulator);
            most = std::max(most, energy_of(simulator));
        }
        report.below(
            fmt::format("ball on a table, budgets of {} in turn: most energy over the first", wall ? "0.1 and 10 ms" : "9 and 1e6 tests"),
            most / first, 1.002);
        report.above(fmt::format("the same, {}: lowest place", wall ? "wall" : "work"), lowest_of(simulator.state().bodies[0].surface),
                     -5e-3, "m");
    }
}

constexpr HardCase kCases[] = {
    {"whole runs", "TenLaunchesGiveTheSameBits", "one final state under a budget of work", ten_launches},
    {"whole runs", "ThreadsChangeNoBit", "one final state", threads_change_no_bit},
    {"whole runs", "ShortCutsChangeNoContact",
     "one final state with every way to cull, and every order of the descent, where no budget decides", short_cuts_change_no_contact},
    {"whole runs", "AResumedRunIsTheSame", "the final state of the uninterrupted run", resumed_run_is_the_same},
    {"whole runs", "ABudgetThatJumpsPumpsNoEnergy", "energy never above 1.002 of the first", a_budget_that_jumps_pumps_no_energy},
};

} // namespace

std::span<const HardCase> hard_runs() noexcept { return kCases; }

} // namespace seldinger::engine
