// Where bodies are: ten thousand sizes from the origin; one wholly inside another from the start.
#include "bench/hard_scenes.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Largest distance of any vertex or node from where the same run at the origin has it, after both were moved on by the same steps.
double farthest_apart(const State& here, const State& there, const Vec3& away) {
    double farthest = 0.0;
    const auto compare = [&](const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
        for (std::size_t k = 0; k < a.size(); ++k) farthest = std::max(farthest, (a[k] + away - b[k]).norm());
    };
    for (std::size_t i = 0; i < here.bodies.size(); ++i) {
        compare(here.bodies[i].surface, there.bodies[i].surface);
        compare(here.bodies[i].tissue.position, there.bodies[i].tissue.position);
    }
    for (std::size_t i = 0; i < here.instruments.size(); ++i) {
        compare(here.instruments[i].rod.position, there.instruments[i].rod.position);
        compare(here.instruments[i].skin, there.instruments[i].skin);
    }
    return farthest;
}

/// mm; a scene may lie no farther off than 100 m. Ten thousand times 10 mm, about the width of what moves here; doubles stand 1.4e-14 m
/// apart there.
constexpr double kAway = 9.9e4;

struct Apart {
    double early = INFINITY, whole = INFINITY; // m, over the first steps and over all; infinite: it stopped
};

/// Both runs side by side; `look` sees the far one after every step.
template <class Look>
Apart run_both(HardReport& report, const std::string& here, const std::string& there, std::uint64_t early, std::uint64_t steps,
               Look&& look) {
    const auto near_scene = prepare_hard_scene(report, here), far_scene = prepare_hard_scene(report, there);
    if (!near_scene || !far_scene) return {};
    Simulator nearby(near_scene->model), distant(far_scene->model);
    Apart apart{0.0, 0.0};
    const bool ran = run_hard(report, distant, steps, [&](const StepReport& step) {
        if (!report.require(nearby.step().finite, "every step at the origin is finite")) return;
        apart.whole = std::max(apart.whole, farthest_apart(nearby.state(), distant.state(), Vec3(1e-3 * kAway, 0.0, 0.0)));
        if (step.step <= early) apart.early = apart.whole;
        look(step, distant.state());
    });
    return ran ? apart : Apart{};
}

void ten_thousand_sizes_from_the_origin(HardReport& report) {
    std::uint64_t exits = 0;
    const Apart tube = run_both(report, tube_scene({.to = 55.0, .bent = true}), tube_scene({.to = 55.0, .bent = true, .away = kAway}), 80,
                                100, [&](const StepReport& step, const State&) { exits += step.lumen_exits; });
    report.equal("wire in a bent tube 99 m away: vertices ever outside", static_cast<double>(exits), 0);
    report.below("wire in a bent tube 99 m away: off the run at the origin before it meets the wall, 0.8 s", tube.early, 1e-12, "m");
    // Then one place of thousands counts as touching a step sooner, and the two diverge as other runs do: within the clearance that the
    // response keeps to the wall, a quarter of the wire's radius.
    report.below("wire in a bent tube 99 m away: off it on the wall", tube.whole, 0.125e-3, "m");
    const auto ball = [](double x) {
        const std::string surface = fmt::format(R"({{"shape": "sphere", "centre": [{}, 0, 6], "radius": 5, "subdivisions": 2}})", x);
        return solid_scene({.bodies = soft_body("ball", surface, 60), .contact = R"("solid_friction": 0.3)", .away = x});
    };
    double lowest = 1.0;
    std::uint64_t inverted = 0;
    const Apart fall = run_both(report, ball(0.0), ball(kAway), 60, 200, [&](const StepReport& step, const State& state) {
        lowest = std::min(lowest, lowest_of(state.bodies[0].surface));
        inverted += step.inverted_tets;
    });
    report.above("ball of 5 mm on a table 99 m away: lowest place", lowest, -1e-3, "m");
    report.equal("ball of 5 mm on a table 99 m away: tets ever inverted", static_cast<double>(inverted), 0);
    // A ball of facets comes down on a corner: which way it tips is decided by the last bit, a difference that grows tenfold in 8 steps.
    report.below("ball of 5 mm on a table 99 m away: off the run at the origin, 0.3 s", fall.early, 1e-6, "m");
    report.below("ball of 5 mm on a table 99 m away: off it, 1 s", fall.whole, 1e-3, "m");
}

void a_ball_inside_a_ball(HardReport& report) {
    const std::string large = soft_body("large", R"({"shape": "sphere", "centre": [0, 0, 31], "radius": 30, "subdivisions": 3})"),
                      small = soft_body("small", R"({"shape": "sphere", "centre": [3, 2, 30], "radius": 5, "subdivisions": 2})", 60);
    for (const char* budget : {"exact", "work:50", "work:0"}) {
        const auto prepared =
            prepare_hard_scene(report, solid_scene({.bodies = large + small, .budget = budget, .contact = R"("solid_friction": 0.3)"}));
        if (!prepared) return;
        const auto& notes = prepared->bodies[1].notes;
        const std::string what = fmt::format("a ball of 5 mm inside one of 30 mm, budget {}", budget);
        report.require(std::find(notes.begin(), notes.end(), "starts wholly inside large: the two do not touch one another") != notes.end(),
                       what + ": preparing it says so");
        Simulator simulator(prepared->model);
        double first = 0.0, most = 0.0, lowest = 1.0;
        std::uint64_t inverted = 0, said = 0;
        if (!run_hard(report, simulator, 300, [&](const StepReport& step) {
                if (step.step == 1) first = energy_of(simulator);
                most = std::max(most, energy_of(simulator));
                inverted += step.inverted_tets;
                said += step.unproven_solids > 0;
                for (std::size_t i = 0; i < 2; ++i) lowest = std::min(lowest, lowest_of(simulator.state().bodies[i].surface));
            }))
            return;
        report.below(what + ": most energy over that at the start", most / first, 1.01);
        report.equal(what + ": tets ever inverted", static_cast<double>(inverted), 0);
        report.above(what + ": lowest place, the table at 0", lowest, -2e-3, "m");
        report.equal(what + ": steps that name the two", static_cast<double>(said), 300);
    }
}

constexpr HardCase kPlacesCases[] = {
    {"places", "TenThousandSizesFromTheOriginNothingChanges",
     "no vertex outside, nothing sinks; the run at the origin to 1e-12 m until the wall is met, then as near as the last bit lets it",
     ten_thousand_sizes_from_the_origin},
    {"places", "ABallThatStartsInsideAnotherIsNamedAndHeatsNothing",
     "named before the run and in every step, no tet inverted, energy never above 1.01 of the first: the two do not touch",
     a_ball_inside_a_ball},
};

} // namespace

std::span<const HardCase> hard_places() noexcept { return kPlacesCases; }

} // namespace trocar::engine
