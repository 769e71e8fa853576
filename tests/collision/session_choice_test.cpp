// When what is kept is not used: by counted work, so never dearer than plain steps by more than a little, and right away where it pays.
#include "collision/search/session_choice.hpp"
#include "tests/collision/sequences.hpp"

#include <gtest/gtest.h>

namespace trocar::collision {
namespace {

using testing::compare;
using testing::make_catheter;
using testing::make_sheet;
using testing::make_soup;
using testing::MeshSequence;
using testing::options_at;
using testing::Totals;

/// Of plain steps, over a sequence whose sessions would cost that much.
double share_of(std::size_t steps, double plain, const auto& session_work) {
    SessionChoice choice;
    double work = 0.0;
    for (std::size_t k = 0; k < steps; ++k) {
        const double spent = choice.wants_plain() ? plain : session_work(k);
        if (choice.wants_plain())
            choice.note_plain(plain);
        else
            choice.note_session(spent, 0.3 * plain);
        work += spent;
    }
    return work / (static_cast<double>(steps) * plain);
}

TEST(SessionChoice, IsNeverMuchDearerThanPlainSteps) {
    for (const double ratio : {1.01, 1.1, 1.5}) {
        const double share = share_of(400, 1000.0, [&](std::size_t) { return ratio * 1000.0; });
        std::printf("sessions at %.2f of a plain step: %.3f\n", ratio, share);
        EXPECT_LE(share, 1.05) << ratio;
    }
    // dear in every other step, and dear at the beginning of every eight
    EXPECT_LE(share_of(400, 1000.0, [](std::size_t k) { return k % 2 == 0 ? 1900.0 : 300.0; }), 1.15);
    EXPECT_LE(share_of(400, 1000.0, [](std::size_t k) { return k % 2 == 0 ? 1900.0 : 500.0; }), 1.05 + 0.15);
    // cheap, then dear for ever
    EXPECT_LE(share_of(400, 1000.0, [](std::size_t k) { return k < 100 ? 500.0 : 1600.0; }), 1.05);
}

TEST(SessionChoice, TakesWhatPays) {
    // the first step is an investment
    const double share = share_of(100, 1000.0, [](std::size_t k) { return k == 0 ? 1800.0 : 200.0; });
    EXPECT_LT(share, 0.25);
    // below what a plain step takes at least: nothing is measured
    SessionChoice choice;
    for (int k = 0; k < 100; ++k) {
        ASSERT_FALSE(choice.wants_plain());
        choice.note_session(200.0, 300.0);
    }
}

TEST(SessionChoice, ComesBackWhenThingsCalmDown) {
    const auto calm_later = [](std::size_t k) { return k < 60 ? 1500.0 : 100.0; };
    EXPECT_LT(share_of(600, 1000.0, calm_later), 0.4);
}

TEST(SessionChoice, OffIsOff) {
    SessionChoice choice(false);
    choice.note_session(1.0, 1.0);
    choice.note_plain(1.0);
    for (int k = 0; k < 20; ++k) choice.note_session(100.0, 1.0);
    EXPECT_FALSE(choice.wants_plain());
}

CoherentOptions falling_back(double distance) {
    CoherentOptions options = options_at(distance);
    options.falls_back = true;
    options.tree = {}; // as the search that it is compared with
    return options;
}

/// Counted work over that of plain steps, with the same contacts; a failed attempt or two are in it, so sequences are not too short.
void expect_no_loss(const char* name, const MeshSequence& q, double most = 1.05) {
    SCOPED_TRACE(name);
    for (const double distance : {0.0, 0.004}) {
        const Totals totals = compare(q, falling_back(distance));
        std::printf("%s at %g: %.3f of the plain work, %zu of %zu steps plain, %zu contacts\n", name, distance,
                    totals.work / totals.work_anew, totals.plain, q.step_count(), totals.contacts);
        EXPECT_LE(totals.work, most * totals.work_anew);
    }
}

TEST(CoherentSearch, CostsNoMoreThanPlainStepsWhateverMoves) {
    constexpr std::size_t kSteps = 60;
    expect_no_loss("soup that wanders fast", make_soup(21, 150, kSteps, 0.1));
    MeshSequence alternating = make_catheter(0, false), everything = make_soup(23, 100, 0, 0.0);
    for (std::size_t k = 1; k <= kSteps; ++k) {
        alternating.add_frame([&](std::size_t s, const Vec3& p, std::size_t) {
            return Vec3(p +
                        (s == 1 ? Vec3(0.03 * static_cast<double>(k / 2 % 3), 0.05 * static_cast<double>(k / 2 % 2), 0.1) : Vec3::Zero()));
        });
        everything.add_frame([&](std::size_t s, const Vec3& p, std::size_t v) { // ten body sizes, this way and that
            const double size = 10.0 * static_cast<double>(k % 2);
            return Vec3(p + (s == 0 ? size : -size) * Vec3(1.0, 0.1 * static_cast<double>(v % 3), -0.2));
        });
    }
    expect_no_loss("fast and still in turn", alternating);
    expect_no_loss("ten body sizes a step", everything);
    MeshSequence teleporting = make_catheter(20, false);
    for (std::size_t k = 0; k < kSteps; ++k) teleporting.starts.push_back(k * 7 % 20);
    expect_no_loss("teleporting", teleporting);
}

TEST(CoherentSearch, StillPaysWhereItMayFallBack) {
    MeshSequence q; // two layers that touch here and there and slide a little
    q.surfaces = {make_sheet(48, 24, 0.02), make_sheet(48, 24, 0.02)};
    for (std::size_t k = 0; k <= 40; ++k)
        q.add_frame([&](std::size_t s, const Vec3& p, std::size_t) {
            const double time = static_cast<double>(k);
            const double wave = 0.004 * std::sin(9.0 * p[0] + 7.0 * p[1] + (s == 0 ? 0.0 : 1.0) + 0.01 * time);
            return Vec3(p[0] + (s == 0 ? 0.0 : 2e-4 * time), p[1], wave + (s == 0 ? 0.0 : 0.004 - 2e-5 * time));
        });
    const Totals totals = compare(q, falling_back(0.0));
    std::printf("%.3f of the plain work, %zu of %zu steps plain, %zu contacts\n", totals.work / totals.work_anew, totals.plain,
                q.step_count(), totals.contacts);
    EXPECT_GT(totals.contacts, 100u);
    EXPECT_LT(totals.work, 0.85 * totals.work_anew);
    EXPECT_LT(4 * totals.plain, q.step_count());
}

} // namespace
} // namespace trocar::collision
