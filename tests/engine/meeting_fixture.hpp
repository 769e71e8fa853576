// Two instruments that press on one another: what holds for devices side by side and for a wire in a bore.
#pragma once

#include "step_fixture.hpp"
#include "tests/fem/rod_apart.hpp"

namespace trocar::engine::test {

/// A fork goes on to the same bits for 30 steps, in which contacts of `a` with `b` are as many as the report counts, press a's way, and lie within `gap` of
/// touching. Returns how many.
/// each   (report): of every step
template <class Each>
std::size_t expect_fork_and_contacts(Simulator& simulator, Thing a, Thing b, double gap, const Each& each) {
    Simulator fork = simulator.fork();
    std::size_t seen = 0;
    for (int step = 0; step < 30; ++step) {
        const StepReport report = simulator.step();
        (void)fork.step();
        EXPECT_EQ(simulator.hash(), fork.hash()) << "step " << step;
        std::size_t own = 0;
        for (const Contact& contact : simulator.contacts())
            if (contact.a == a && contact.b == b) {
                ++own;
                EXPECT_GT(contact.force.dot(contact.normal), 0.0);
                EXPECT_LT(std::abs(contact.gap), gap);
            }
        EXPECT_EQ(own, report.instrument_contacts);
        seen += own;
        each(report);
    }
    return seen;
}

/// In sums of radii, of what has come out of the ports.
inline double nearest_of(const SceneModel& model, const State& state) {
    const auto &a = state.instruments[0].rod, &b = state.instruments[1].rod;
    const auto first = [&](std::size_t i) { return fem::first_inserted_node(model.instruments[i].rod, state.instruments[i].rod.insertion); };
    double least = 1.0;
    for (std::size_t i = first(0); i + 1 < a.position.size(); ++i)
        for (std::size_t j = first(1); j + 1 < b.position.size(); ++j)
            least = std::min(least, fem::distance_by_search(a.position[i], a.position[i + 1], b.position[j], b.position[j + 1]));
    return least / (model.instruments[0].rod.design.radius + model.instruments[1].rod.design.radius);
}

} // namespace trocar::engine::test
