#include "collision/hold_back.hpp"

#include <algorithm>

namespace seldinger::collision {

void lower_fractions(std::span<const Contact> contacts, std::span<const double> safe_times, BodyId body, std::span<double> fraction) {
    const auto lower = [&](std::span<const Index> feature, double time) {
        for (const Index vertex : feature)
            if (vertex != kNoIndex) fraction[vertex] = std::min(fraction[vertex], time);
    };
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        if (contacts[i].body_a == body) lower(contacts[i].feature_a, safe_times[i]);
        if (contacts[i].body_b == body) lower(contacts[i].feature_b, safe_times[i]);
    }
}

void shorten(std::span<const Vec3> t0, std::span<const double> fraction, std::span<Vec3> t1) {
    for (std::size_t v = 0; v < t1.size(); ++v) {
        if (fraction[v] >= 1.0) continue;
        t1[v] = fraction[v] <= 0.0 ? t0[v] : Vec3(t0[v] + fraction[v] * (t1[v] - t0[v]));
    }
}

HoldReport MotionHolder::hold(ContactFinder& finder, HeldSurface a, HeldSurface b, const ExactOptions& options, WorkBudget& budget,
                              unsigned max_rounds) {
    HoldReport report;
    fraction_a_.assign(a.t0.size(), 1.0);
    fraction_b_.assign(b.t0.size(), 1.0);
    const auto finish = [&](bool proven) {
        for (const auto& fractions : {std::span<const double>(fraction_a_), std::span<const double>(fraction_b_)})
            for (const double f : fractions) {
                report.held += f < 1.0;
                report.smallest_fraction = std::min(report.smallest_fraction, f);
            }
        report.proven = proven;
        return report;
    };
    ExactStats stats;
    for (;;) {
        const SurfaceMotion motion_a{a.topology, a.t0, a.t1}, motion_b{b.topology, b.t0, b.t1};
        a.tree->refit(motion_a);
        b.tree->refit(motion_b);
        contacts_.clear();
        stats = finder.find(motion_a, *a.tree, motion_b, *b.tree, options, budget, contacts_);
        ++report.rounds;
        if (stats.safe_fraction >= 1.0) return finish(true);
        if (report.rounds >= max_rounds || !stats.finished) break;
        round_a_.assign(a.t0.size(), 1.0);
        round_b_.assign(b.t0.size(), 1.0);
        lower_fractions(contacts_, finder.safe_times(), options.body_a, round_a_);
        lower_fractions(contacts_, finder.safe_times(), options.body_b, round_b_);
        apply(round_a_, a, fraction_a_);
        apply(round_b_, b, fraction_b_);
    }
    round_a_.assign(a.t0.size(), stats.safe_fraction);
    round_b_.assign(b.t0.size(), stats.safe_fraction);
    apply(round_a_, a, fraction_a_);
    apply(round_b_, b, fraction_b_);
    return finish(true);
}

void MotionHolder::apply(std::span<const double> round, const HeldSurface& surface, std::span<double> fraction) {
    shorten(surface.t0, round, surface.t1);
    for (std::size_t v = 0; v < fraction.size(); ++v) fraction[v] *= round[v];
}

} // namespace seldinger::collision
