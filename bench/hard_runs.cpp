// Whole runs: the same bits from launch to launch, on any number of threads, with every shortcut disabled; budgets that jump.
#include "bench/hard_scenes.hpp"
#include "engine/step/checkpoint.hpp"
#include "fem/tissue/kernels.hpp"
#include "fem/embedding/link_kernels.hpp"
#include "fem/tissue/integrate.hpp"

#include <algorithm>
#include <set>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kSteps = 60;

/// What a run came to.
struct Whole {
    std::uint64_t hash = 0;               // of the state after kSteps; 0 where the run stopped
    std::vector<std::uint64_t> contacts;  // of every step: hit, pressed, of leaf spheres, of solids, listed
    std::uint64_t culled_candidates = 0, sum = 0; // candidates that a culler saw; all contacts
};

Whole run_whole(HardReport& report, const SceneModel& model) {
    Simulator simulator(model);
    Whole whole;
    for (std::uint64_t k = 0; k < kSteps; ++k) {
        const StepReport& step = simulator.step();
        if (!report.require(step.finite, "every step is finite: " + step.failure)) return whole;
        whole.culled_candidates += step.cull_items;
        for (const std::uint64_t count :
             {step.exact_contacts, step.pressing_contacts, step.leaf_contacts, step.solid_touches, simulator.contacts().size()}) {
            whole.contacts.push_back(count);
            whole.sum += count;
        }
    }
    whole.hash = hash_state(simulator.state());
    return whole;
}

std::uint64_t run_and_hash(HardReport& report, const SceneModel& model) { return run_whole(report, model).hash; }

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

/// A block of some thousand nodes with a vessel in it, finely meshed: work for several threads at every step of the way.
std::string large_organ() {
    return R"({"name": "large organ", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 0.2}, "bodies": {
        "organ": {"kind": "deformable", "surface": {"shape": "box", "centre": [0, 0, 50], "extent": [80, 60, 80], "cells": 54},
            "material": {"young_modulus": 5, "poisson_ratio": 0.4, "density": 1000, "mass_damping": 5},
            "coarse": {"mesher": "lattice", "surface_triangles": 4000}, "fixed": [{"direction": [0, 1, 0], "fraction": 0.1}]},
        "tube": {"kind": "static", "hollow": true, "embedded_in": "organ", "blend": 5,
            "surface": {"shape": "tube", "sides": 48, "axis": [[0, 0, 0, 3], [0, 0, 50, 3], [5, 0, 100, 3]]}}},
        "effects": ["elasticity", "damping"]})";
}

void threads_change_no_bit(HardReport& report) {
    const auto prepared = prepare_hard_scene(report, large_organ());
    if (!prepared) return;
    const fem::TissueModel& tissue = *prepared->model.bodies[0].tissue;
    const fem::RigidLinks& links = *prepared->model.bodies[0].links;
    const auto blocks = [](std::size_t count, std::size_t least) { return static_cast<double>(count) / static_cast<double>(least); };
    // Eight threads get a block each, of tets, nodes, link triangles and vertices alike: fewer would not test them.
    report.above("chunks of tets", static_cast<double>(tissue.plan.chunks.size()), 8.0);
    report.above("blocks of nodes", blocks(tissue.node_count(), fem::kLeastNodes), 8.0);
    report.above("blocks of link triangles", blocks(links.frame_nodes.size(), fem::kLeastFrames), 8.0);
    report.above("blocks of linked vertices", blocks(links.vertex_count(), fem::kLeastVertices), 8.0);
    std::set<std::uint64_t> hashes;
    for (const unsigned threads : {1u, 2u, 3u, 8u}) {
        State state = make_initial_state(prepared->model);
        fem::RkWorkspace rk{.threads = threads};
        fem::StableStepWorkspace stable{.threads = threads};
        fem::LinkFrames frames[] = {{.threads = threads}, {.threads = threads}};
        for (int frame = 0; frame < 10; ++frame) {
            const auto done =
                fem::advance(tissue, state.bodies[0].tissue, 0.01, {.gravity = Vec3(0.0, -9.81, 0.0)}, {.max_substeps = 5000}, rk, stable);
            if (!report.require(done.integrate.finite() && !done.refused, "finite and not refused")) return;
            for (std::size_t i = 0; i < 2; ++i) {
                const BodyModel& body = prepared->model.bodies[i];
                (void)fem::update_embedded_surface(*body.links, state.bodies[0].tissue.position, body.surface.vertices, frames[i], state.bodies[i].surface);
            }
        }
        hashes.insert(hash_state(state));
    }
    report.equal("tissue and links on 1, 2, 3 and 8 threads: different final states", static_cast<double>(hashes.size()), 1);
}

/// One of several runs that must be the same, beside the first of them.
void compare(HardReport& report, const std::string& what, const std::vector<Whole>& runs) {
    int other_states = 0, other_contacts = 0;
    for (const Whole& run : runs) {
        other_states += run.hash != runs[0].hash;
        other_contacts += run.contacts != runs[0].contacts;
    }
    report.equal(what + ": final states that differ from the first", other_states, 0);
    report.equal(what + ": runs with other contacts in some step", other_contacts, 0);
    report.above(what + ": contacts of a run", static_cast<double>(runs[0].sum), 0);
}

void short_cuts_change_no_contact(HardReport& report) {
    // Under `exact` nothing is left to a budget: whatever saves work must not change the answer.
    const auto prepared = prepare_hard_scene(report, organ_scene("exact"));
    if (!prepared) return;
    std::vector<Whole> runs;
    std::uint64_t culled_candidates = 0;
    for (const Culling culling : {Culling::Never, Culling::Cpu, Culling::Auto}) {
        SceneModel model = prepared->model;
        model.contact.culling = culling;
        model.contact.clearance = 1e-3; // many candidates, or there would be nothing to cull
        model.contact.exact_distance = 0.9e-3;
        runs.push_back(run_whole(report, model));
        if (culling == Culling::Cpu) culled_candidates = runs.back().culled_candidates;
    }
    compare(report, fmt::format("wire in an organ, {} ways to cull", runs.size()), runs);
    report.above("wire in an organ: candidates that the CPU reference tested", static_cast<double>(culled_candidates), 0);
}

void a_budget_larger_than_needed_is_none(HardReport& report) {
    for (const bool heap : {false, true}) {
        std::vector<Whole> runs;
        for (const char* budget : {"exact", "work:1000000000"}) {
            const auto prepared = prepare_hard_scene(
                report, heap ? solid_scene({.bodies = heap_bodies(5), .budget = budget, .contact = R"("solid_friction": 0.2)"})
                             : organ_scene(budget));
            if (!prepared) return;
            runs.push_back(run_whole(report, prepared->model));
        }
        compare(report, fmt::format("{}, exact and a billion units of work", heap ? "five balls" : "wire in an organ"), runs);
    }
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
            const BudgetLimits limits = wall ? BudgetLimits{BudgetMode::Wall, tight ? 1e-4 : 1e-2, 0}
                                             : BudgetLimits{BudgetMode::Work, 0.0, tight ? std::uint64_t{9} : std::uint64_t{1'000'000}};
            Inputs inputs;
            inputs.budget = limits;
            if (!report.require(simulator.step(inputs).ok(), "a budget is taken")) return;
            if (!report.require(simulator.report().finite, "every step is finite")) return;
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

constexpr HardCase kRunsCases[] = {
    {"whole runs", "TenLaunchesGiveTheSameBits", "one final state under a budget of work", ten_launches},
    {"whole runs", "ThreadsChangeNoBit", "one final state", threads_change_no_bit},
    {"whole runs", "ShortCutsChangeNoContact",
     "one final state and the same contacts in every step, with every way to cull and every order of the descent, no budget",
     short_cuts_change_no_contact},
    {"whole runs", "ABudgetLargerThanNeededIsNone", "the final state and the contacts of a run without a budget",
     a_budget_larger_than_needed_is_none},
    {"whole runs", "AResumedRunIsTheSame", "the final state of the uninterrupted run", resumed_run_is_the_same},
    {"whole runs", "ABudgetThatJumpsPumpsNoEnergy", "energy never above 1.002 of the first", a_budget_that_jumps_pumps_no_energy},
};

} // namespace

std::span<const HardCase> hard_runs() noexcept { return kRunsCases; }

} // namespace trocar::engine
