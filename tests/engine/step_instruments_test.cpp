// Kinds of instruments in the whole step: a rod that twists, a chain of masses and springs, a wire in a catheter.
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

using test::Tally;

struct Options {
    std::string effects = R"("coarse_contact", "exact_contact", "friction")";
    std::string budget = "exact";
    std::string instruments = {};
    std::string contact = {};
    double duration = 4.0; // s
};

/// A bent tube of 3 mm and instruments that enter it at 10 mm.
std::string tube_scene(const Options& options) {
    return fmt::format(R"({{
    "name": "instruments-in-a-bent-tube",
    "units": {{"length": "mm", "pressure": "kPa"}},
    "time": {{"step": 0.01, "duration": {}}},
    "budget": "{}", {}
    "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [{}], "sides": 20}}}}}},
    "instruments": {{{}}},
    "effects": [{}]
}})",
                       options.duration, options.budget, options.contact, test::bent_axis(25.0, 3.0), options.instruments, options.effects);
}

constexpr const char* kEntry = R"("lumen": "tube", "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]})";

std::string turned_wire(const std::string& more, const std::string& path) {
    return fmt::format(R"("wire": {{"length": 220, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {{"shape": "J", "length": 12, "angle": 0.8}}, {}, {} "path": {}}})",
                       kEntry, more, path);
}

TEST(TwistingWire, LagsBehindTheHandleInABendAndFollowsInTheEnd) {
    Options options;
    options.effects += R"(, "twist")";
    options.instruments = turned_wire("\"friction\": 0.2,", "[[0, 20, 0], [3, 120, 0], [4.5, 120, 4.5], [6, 120, 4.5]]");
    options.duration = 6.0;
    const PreparedScene prepared = test::prepare(tube_scene(options));
    Simulator simulator(prepared.model);
    double largest_lag = 0.0;
    Tally tally;
    for (int k = 0; k < 600; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        tally.lumen_exits += report.lumen_exits;
        const fem::RodState& rod = simulator.state().instruments[0].rod;
        largest_lag = std::max(largest_lag, rod.rotation - rod.angle.back());
    }
    const fem::RodState& rod = simulator.state().instruments[0].rod;
    std::cout << "largest lag of the tip " << largest_lag << " rad, at the end " << rod.rotation - rod.angle.back() << " rad\n";
    EXPECT_EQ(tally.lumen_exits, 0u);
    EXPECT_GT(largest_lag, 0.02) << "friction in the bend winds the shaft up";
    EXPECT_LT(largest_lag, 3.0);
    EXPECT_LT(std::abs(rod.rotation - rod.angle.back()), largest_lag + 1e-12);
}

TEST(TwistingWire, GivesTheSameBitsTwiceAndHasNoAnglesWithoutTheEffect) {
    Options options;
    options.effects += R"(, "twist")";
    options.budget = "work:3000";
    options.instruments = turned_wire("", "[[0, 20, 0], [3, 120, 3]]");
    const PreparedScene prepared = test::prepare(tube_scene(options));
    std::uint64_t hash[2];
    for (std::uint64_t& one : hash) {
        Simulator simulator(prepared.model);
        EXPECT_EQ(test::run_steps(simulator, 150).steps, 150u);
        one = hash_state(simulator.state());
    }
    EXPECT_EQ(hash[0], hash[1]);
    options.effects = R"("coarse_contact", "exact_contact")";
    const PreparedScene plain = test::prepare(tube_scene(options));
    EXPECT_TRUE(make_initial_state(plain.model).instruments[0].rod.angle.empty());
}

TEST(PigtailWire, CoilsUpBeyondTheEntryAndIsPushedThroughABend) {
    Options options;
    options.instruments = R"("wire": {"length": 220, "radius": 0.4, "young_modulus": 60000, "segment": 1.5, "skin_triangles": 1500,
        "tip": {"shape": "pigtail", "length": 20, "angle": 5.5}, "path": [[0, 20, 0], [3, 110, 1]], )" +
                          std::string(kEntry) + "}";
    const PreparedScene prepared = test::prepare(tube_scene(options));
    Simulator simulator(prepared.model);
    const Tally tally = test::run_steps(simulator, 300);
    EXPECT_EQ(tally.steps, 300u) << tally;
    EXPECT_EQ(tally.lumen_exits, 0u) << tally;
    EXPECT_GT(tally.insertion, 0.09) << tally;
}

TEST(MassSpringWire, StaysInTheTubeLikeTheRod) {
    Options options;
    options.contact = R"("contact": {"rod_stiffness": 5},)";
    options.instruments = turned_wire(R"("kind": "mass_spring",)", "[[0, 40, 0], [1.5, 92, 0]]");
    const PreparedScene prepared = test::prepare(tube_scene(options));
    ASSERT_GT(prepared.model.instruments[0].mass_spring_substeps, 100u);
    options.instruments = turned_wire("", "[[0, 40, 0], [1.5, 92, 0]]");
    const PreparedScene implicit = test::prepare(tube_scene(options));
    Simulator chain(prepared.model), rod(implicit.model);
    const Tally tally = test::run_steps(chain, 150), other = test::run_steps(rod, 150);
    std::cout << "sub-steps " << prepared.model.instruments[0].mass_spring_substeps << ", tips apart by "
              << 1e3 * (tally.last.tip - other.last.tip).norm() << " mm\n";
    EXPECT_EQ(tally.steps, 150u) << tally;
    EXPECT_EQ(tally.lumen_exits, 0u) << tally;
    EXPECT_GT(tally.insertion, 0.08) << tally;
    EXPECT_LT((tally.last.tip - other.last.tip).norm(), 2e-3) << "where the tip lies on the wall depends on friction's history";
}

/// A straight catheter and a wire with a J tip in its bore.
std::string over_the_wire(const std::string& catheter_path, const std::string& wire_path) {
    return fmt::format(R"("catheter": {{"length": 200, "radius": 0.8, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {{"shape": "straight"}}, {}, "path": {}}},
        "wire": {{"inside": "catheter", "length": 260, "radius": 0.3, "young_modulus": 2000000, "segment": 2, "skin_triangles": 1500,
        "stiffness": [[0, 0.05], [20, 0.1], [50, 1]], "tip": {{"shape": "J", "length": 10, "angle": 0.8}}, "path": {}}})",
                       kEntry, catheter_path, wire_path);
}

TEST(WireInACatheter, LeadsThroughTheBendTheCatheterFollowsAndTheWireIsDrawnBack) {
    for (const char* budget : {"exact", "work:500"}) {
        Options options;
        options.budget = budget;
        options.instruments =
            over_the_wire("[[0, 20, 0], [2.5, 20, 0], [5.5, 110, 0]]", "[[0, 20, 0], [2.5, 100, 0], [3, 100, 1], [5.5, 100, 1], [7.5, 40, 0]]");
        const PreparedScene prepared = test::prepare(tube_scene(options));
        ASSERT_EQ(prepared.model.instruments.size(), 2u);
        Simulator simulator(prepared.model);
        const Tally led = test::run_steps(simulator, 250);
        const Vec3 wire_tip = simulator.state().instruments[1].rod.position.back();
        EXPECT_EQ(led.steps, 250u) << budget << ": " << led;
        EXPECT_EQ(led.lumen_exits, 0u) << budget << ": " << led;
        EXPECT_LT((simulator.state().instruments[0].rod.position.back() - Vec3(0, 0, 0.03)).norm(), 2e-3)
            << budget << ": the catheter waits";
        EXPECT_GT(wire_tip.x(), 0.02) << budget << ": round the bend, " << led;
        const Tally followed = test::run_steps(simulator, 300);
        EXPECT_EQ(followed.lumen_exits, 0u) << budget << ": " << followed;
        EXPECT_GT(simulator.state().instruments[0].rod.position.back().x(), 0.02) << budget << ": over the wire, " << followed;
        const Tally drawn = test::run_steps(simulator, 200);
        EXPECT_EQ(drawn.lumen_exits, 0u) << budget << ": " << drawn;
        const fem::RodState &catheter = simulator.state().instruments[0].rod, &wire = simulator.state().instruments[1].rod;
        EXPECT_LT(wire.insertion, 0.045) << budget << ": " << drawn;
        EXPECT_GT(catheter.insertion, 0.09) << budget << ": it stays where it is, " << drawn;
        EXPECT_TRUE(test::all_finite(simulator.state()));
    }
}

TEST(WireInACatheter, GivesTheSameBitsTwiceTwistingOrNot) {
    for (const char* more : {"", R"(, "twist")"}) {
        Options options;
        options.effects += more;
        options.budget = "work:3000";
        options.instruments = over_the_wire("[[0, 30, 0], [2, 60, 3]]", "[[0, 20, 0], [2, 85, -3]]");
        const PreparedScene prepared = test::prepare(tube_scene(options));
        std::uint64_t hash[2];
        for (std::uint64_t& one : hash) {
            Simulator simulator(prepared.model);
            const Tally tally = test::run_steps(simulator, 200);
            EXPECT_EQ(tally.steps, 200u) << more << tally;
            EXPECT_EQ(tally.lumen_exits, 0u) << more << tally;
            one = hash_state(simulator.state());
        }
        EXPECT_EQ(hash[0], hash[1]) << more;
    }
}

} // namespace
} // namespace trocar::engine
