// An interactive run without a network: it repeats bit for bit from what it recorded, and commands do what they say.
#include "../engine/step_fixture.hpp"

#include "engine/effects/registry.hpp"
#include "engine/viewer/latest.hpp"
#include "engine/viewer/session.hpp"
#include "engine/viewer/snapshot.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include <unistd.h>

namespace trocar::engine::viewer {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct Loaded {
    Scene scene;
    PreparedScene prepared;
};
Loaded load(const std::string& text) {
    Result<Scene> scene = parse_scene(text, "scenes/viewer.json");
    EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
    if (!scene.ok()) return {};
    return {*scene, test::prepare(text)};
}

test::BentTube bent(std::string budget, std::string host_body = {}) {
    return {35, std::move(budget),
            host_body.empty() ? R"("coarse_contact", "exact_contact")" : R"("elasticity", "damping", "coarse_contact", "exact_contact")",
            std::move(host_body)};
}

/// A wire in a tube, in units that have no exact binary fractions.
const std::string kOddUnits = R"({
    "name": "odd-units",
    "units": {"length": "mm", "time": "ms", "angle": "deg", "pressure": "MPa"},
    "time": {"step": 7, "duration": 200},
    "budget": "work:5000",
    "bodies": {"tube": {"kind": "static", "hollow": true,
        "surface": {"shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 120, 4]], "sides": 16}}},
    "instruments": {"wire": {"length": 100, "radius": 0.5, "young_modulus": 60, "segment": 5, "skin_triangles": 600,
        "tip": {"shape": "J", "length": 12, "angle": 30}, "lumen": "tube", "inserted": 20.1,
        "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]}}},
    "effects": ["coarse_contact", "exact_contact"]
})";

/// Drive commands: push, turn, draw back, release, push against the bend.
Drive drive_at(int step) {
    const double insertion = step % 90 < 60 ? 1.0 : step % 90 < 75 ? -0.37 : 0.0;
    return {insertion, step % 50 < 20 ? 0.83 : -1.0};
}

/// Repeats the recording as `run --path` does, and gives the state's hash.
std::uint64_t hash_of_run(const std::string& scene_text, const std::string& csv, const BudgetLimits& limits, std::size_t steps) {
    const std::filesystem::path file = std::filesystem::temp_directory_path() / fmt::format("trocar-viewer-{}.csv", getpid());
    std::ofstream(file) << csv;
    Result<Scene> scene = parse_scene(scene_text, "scenes/viewer.json");
    EXPECT_TRUE(scene.ok());
    const auto path = read_instrument_paths(*scene, file);
    std::filesystem::remove(file);
    EXPECT_TRUE(path.ok()) << (path.ok() ? "" : path.error().to_string());
    if (!path.ok()) return 0;
    scene->budget.limits = limits;
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    EXPECT_TRUE(prepared.ok());
    Simulator simulator(prepared->model);
    for (std::size_t k = 0; k < steps; ++k) simulator.step();
    return hash_state(simulator.state());
}

struct Replayed {
    std::string name, scene;
    BudgetLimits limits;
    int steps;
};
void PrintTo(const Replayed& tested, std::ostream* os) { *os << tested.name; }
class Recorded : public ::testing::TestWithParam<Replayed> {};

TEST_P(Recorded, RunRepeatsBitForBit) {
    const Replayed& tested = GetParam();
    const Loaded loaded = load(tested.scene);
    Session session(loaded.scene, loaded.prepared);
    session.apply(SetBudget{tested.limits});
    std::uint64_t scaled_step_count = 0;
    for (int k = 0; k < tested.steps; ++k) {
        session.apply(drive_at(k));
        const StepReport& report = session.step();
        ASSERT_TRUE(report.finite) << report.failure;
        scaled_step_count += report.drive_stops + (report.safe_fraction < 1.0);
    }
    const auto& recording = session.recording();
    ASSERT_TRUE(recording->repeatable());
    ASSERT_EQ(recording->steps(), static_cast<std::size_t>(tested.steps));
    const std::uint64_t hash = hash_state(session.simulator().state());
    const std::string csv = recording->text(loaded.scene, recording->steps(), hash);
    EXPECT_THAT(csv, HasSubstr(fmt::format("# state_hash {:016x}\n", hash)));
    EXPECT_THAT(csv, HasSubstr("# Bit for bit: trocar run"));
    EXPECT_EQ(hash_of_run(tested.scene, csv, tested.limits, recording->steps()), hash) << scaled_step_count << " steps scaled to the safe fraction";
    EXPECT_NE(hash_of_run(tested.scene, csv, tested.limits, recording->steps() - 1), hash);
}

INSTANTIATE_TEST_SUITE_P(
    , Recorded,
    ::testing::Values(Replayed{"OfABendUnderWork", test::bent_tube_scene(bent("work:20000")), {BudgetMode::Work, 0, 20'000}, 400},
                      Replayed{"OfABendUnderLittleWork", test::bent_tube_scene(bent("exact")), {BudgetMode::Work, 0, 150}, 400},
                      Replayed{
                          "OfABendInTissue", test::bent_tube_scene(bent("work:50000", test::kOrgan)), {BudgetMode::Work, 0, 50'000}, 200},
                      Replayed{"OfExactSteps", test::bent_tube_scene(bent("exact")), {}, 200},
                      Replayed{"InOddUnits", kOddUnits, {BudgetMode::Work, 0, 5000}, 300}),
    [](const ::testing::TestParamInfo<Replayed>& tested) { return tested.param.name; });

TEST(ViewerSession, SaysWhyARecordingDoesNotRepeat) {
    const std::string text = test::bent_tube_scene(bent("work:5000", test::kOrgan));
    const Loaded loaded = load(text);
    Session session(loaded.scene, loaded.prepared);
    const auto remarks = [&] { return session.recording()->text(loaded.scene, session.recording()->steps(), 0); };
    session.step();
    EXPECT_TRUE(session.recording()->repeatable());
    session.apply(Grab{0, 0, Vec3(0, 0, 0.2)});
    EXPECT_THAT(remarks(), HasSubstr("tissue was pulled"));
    session.apply(Restart{});
    EXPECT_TRUE(session.recording()->repeatable());
    session.step();
    session.apply(SetBudget{{BudgetMode::Work, 0, 700}});
    EXPECT_THAT(remarks(), HasSubstr("budget was changed"));
    session.apply(Restart{});
    session.apply(SwitchEffect{&effects::exact_contact, false});
    EXPECT_THAT(remarks(), HasSubstr("effect was switched"));
    session.apply(Restart{}); // the effect stays off: still not what the scene says
    EXPECT_THAT(remarks(), HasSubstr("effect was switched"));
    session.apply(SwitchEffect{&effects::exact_contact, true});
    session.apply(SetBudget{{BudgetMode::Wall, 0.01, 0}});
    session.apply(Restart{});
    EXPECT_THAT(remarks(), HasSubstr("budget was a time"));
    EXPECT_THAT(remarks(), Not(HasSubstr("Bit for bit")));
}

TEST(ViewerSession, DrivesNoFasterThanTheLimits) {
    const Loaded loaded = load(test::bent_tube_scene(bent("exact")));
    Session session(loaded.scene, loaded.prepared);
    const double start = session.simulator().state().instruments[0].rod.insertion;
    session.apply(Drive{1.0, 1.0});
    for (int k = 0; k < 50; ++k) session.step();
    const StepReport& report = session.simulator().report();
    EXPECT_NEAR(report.insertion_m - start, 0.035 * 0.5, 1e-9);
    EXPECT_NEAR(report.rotation_rad, 3.14 * 0.5, 1e-9);
    session.apply(Drive{});
    session.step();
    const double there = session.simulator().report().insertion_m;
    session.step();
    EXPECT_EQ(session.simulator().report().insertion_m, there);
}

/// Against a closed end: drive commands do not accumulate, and it reverses at once.
TEST(ViewerSession, ADriveThatIsStoppedReversesAtOnce) {
    std::string text = kOddUnits;
    text.replace(text.find("[0, 0, 120, 4]"), 14, "[0, 0, 60, 4]"); // the tube ends 50 mm beyond the entry
    const Loaded loaded = load(text);
    Session session(loaded.scene, loaded.prepared);
    session.apply(Drive{1.0, 0.0});
    for (int k = 0; k < 600; ++k) session.step();
    const double furthest = session.simulator().report().insertion_m;
    session.apply(Drive{-1.0, 0.0});
    for (int k = 0; k < 20; ++k) session.step();
    EXPECT_LT(session.simulator().report().insertion_m, furthest - 10 * 0.035 * 0.007);
}

TEST(ViewerSession, ADriveToAPlaceGoesThereAtTheLimitsStaysAndIsRecorded) {
    const std::string text = test::bent_tube_scene(bent("work:20000"));
    const Loaded loaded = load(text);
    Session session(loaded.scene, loaded.prepared);
    const auto steps = [&](int count) {
        for (int k = 0; k < count; ++k) session.step();
        return session.simulator().report();
    };
    const double start = session.simulator().state().instruments[0].rod.insertion;
    session.apply(DriveTo{start + 0.01, -0.5});
    EXPECT_NEAR(steps(10).insertion_m, start + 0.035 * 0.1, 1e-9);
    EXPECT_NEAR(steps(60).insertion_m, start + 0.01, 1e-9);
    EXPECT_NEAR(steps(5).rotation_rad, -0.5, 1e-9);
    session.apply(DriveTo{100.0, 0.0}); // farther than it is long
    session.apply(Drive{-1.0, 0.0});    // ends it
    EXPECT_LT(steps(10).insertion_m, start + 0.0066);
    session.apply(FollowScript{true});
    session.apply(DriveTo{start, 0.0});
    EXPECT_FALSE(session.status().script);
    EXPECT_NEAR(steps(60).insertion_m, start, 1e-9);
    const auto& recording = session.recording();
    ASSERT_TRUE(recording->repeatable());
    const std::uint64_t hash = hash_state(session.simulator().state());
    EXPECT_EQ(hash_of_run(text, recording->text(loaded.scene, recording->steps(), hash), session.status().budget, recording->steps()), hash);
}

TEST(ViewerSession, ASmallerBudgetStopsAtACoarserLevelAndSaysHowWrongItMayBe) {
    const Loaded loaded = load(test::bent_tube_scene(bent("exact")));
    Session session(loaded.scene, loaded.prepared);
    session.apply(Drive{1.0, 0.0});
    for (int k = 0; k < 100; ++k) session.step();
    const StepReport full = session.simulator().report();
    EXPECT_EQ(full.pairs_open, 0u);
    EXPECT_EQ(session.assumed_error_m(), 0.0);
    session.apply(SetBudget{{BudgetMode::Work, 0, 2}});
    session.step();
    const StepReport little = session.simulator().report();
    EXPECT_GT(little.pairs_open, 0u);
    EXPECT_GT(little.assumed, 0u);
    EXPECT_LT(little.level_reached, full.level_reached);
    if (!little.exact_ran) {
        EXPECT_GT(session.assumed_error_m(), 0.0);
    }
}

TEST(ViewerSession, APullMovesTissueTowardsItsTarget) {
    const Loaded loaded = load(test::bent_tube_scene(bent("exact", test::kOrgan)));
    Session session(loaded.scene, loaded.prepared);
    const std::vector<Vec3>& surface = session.simulator().state().bodies[0].surface;
    Index vertex = 0; // the freest: furthest from the held side, which is where y is largest
    for (Index v = 0; v < surface.size(); ++v)
        if (surface[v].y() < surface[vertex].y()) vertex = v;
    const Vec3 start = surface[vertex], target = start + Vec3(0.0, -0.01, 0.0);
    session.apply(Grab{0, vertex, target});
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(session.step().finite) << session.simulator().report().failure;
    const double moved = start.y() - surface[vertex].y();
    EXPECT_GT(moved, 5e-4);
    EXPECT_LT(moved, 0.0105);
    EXPECT_GT(session.simulator().report().pull_force_n, 0.0);
    session.apply(LetGo{});
    for (int k = 0; k < 300; ++k) session.step();
    EXPECT_LT(start.y() - surface[vertex].y(), 0.3 * moved); // it springs back
    EXPECT_EQ(session.simulator().report().pull_force_n, 0.0);
}

/// Steps in which the exact stage ran, of so many driven ones.
int count_exact(Session& session, int steps) {
    int exact = 0;
    for (int k = 0; k < steps; ++k) {
        session.apply(drive_at(k));
        exact += session.step().exact_ran;
    }
    return exact;
}

TEST(ViewerSession, SaysHowMuchWorkTheExactStageNeedsBeforeAndAfterItRan) {
    for (const std::string& text : {kOddUnits, test::bent_tube_scene(bent("10s")), test::bent_tube_scene(bent("10s", test::kOrgan))}) {
        const Loaded loaded = load(text);
        constexpr int kSteps = 180;
        Session session(loaded.scene, loaded.prepared);
        const auto record = [&] { // as the page does
            session.apply(SetBudget{{BudgetMode::Work, 0, session.work_enough()}});
            session.apply(Restart{});
        };
        record();
        EXPECT_EQ(count_exact(session, kSteps), kSteps) << loaded.scene.name << ": recorded before any step";
        session.apply(SetBudget{{BudgetMode::Wall, 10.0, 0}});
        session.apply(Restart{});
        EXPECT_EQ(count_exact(session, kSteps), kSteps) << loaded.scene.name << ": live";
        record();
        EXPECT_EQ(count_exact(session, kSteps), kSteps) << loaded.scene.name << ": recorded afterwards";
        EXPECT_TRUE(session.recording()->repeatable());
        session.apply(SetBudget{{BudgetMode::Work, 0, 100}});
        EXPECT_LT(count_exact(session, kSteps), kSteps) << loaded.scene.name << ": too little is not enough";
    }
}

TEST(ViewerSession, KnowsWhereTheInstrumentStandsBeforeTheFirstStepAndAfterARestart) {
    const Loaded loaded = load(kOddUnits);
    Session session(loaded.scene, loaded.prepared);
    Snapshot snapshot;
    prepare_snapshot(session, snapshot);
    for (int round = 0; round < 2; ++round) {
        fill_snapshot(session, false, snapshot);
        const InstrumentState& wire = session.simulator().state().instruments.front();
        EXPECT_EQ(snapshot.report.step, 0u);
        EXPECT_NEAR(snapshot.report.insertion_m, 20.1e-3, 1e-12);
        EXPECT_EQ(snapshot.report.rotation_rad, wire.rod.rotation);
        EXPECT_EQ(snapshot.report.tip, wire.rod.position.back());
        session.apply(Drive{1.0, 0.5});
        for (int k = 0; k < 5; ++k) session.step();
        fill_snapshot(session, false, snapshot);
        EXPECT_GT(snapshot.report.insertion_m, 20.2e-3);
        session.apply(Restart{});
    }
}

TEST(ViewerSession, PausesAndStepsOneByOne) {
    const Loaded loaded = load(kOddUnits);
    Session session(loaded.scene, loaded.prepared);
    EXPECT_TRUE(session.wants_step());
    session.apply(SingleStep{}); // means nothing while it runs
    session.apply(Pause{true});
    EXPECT_FALSE(session.wants_step());
    session.apply(SingleStep{});
    EXPECT_TRUE(session.wants_step());
    session.step();
    EXPECT_FALSE(session.wants_step());
}

TEST(ViewerSession, SwitchesOnlyEffectsOfTheScene) {
    const Loaded loaded = load(kOddUnits);
    Session session(loaded.scene, loaded.prepared);
    EXPECT_FALSE(session.permits(effects::gravity));
    session.apply(SwitchEffect{&effects::gravity, true});
    EXPECT_FALSE(session.model().effects.gravity.has_value());
    for (const bool on : {false, true, false, true}) {
        session.apply(SwitchEffect{&effects::coarse_contact, on});
        for (int k = 0; k < 20; ++k) ASSERT_TRUE(session.step().finite);
        EXPECT_EQ(session.simulator().report().pairs_tested > 0, on);
    }
}

/// In work mode nothing but the commands and their steps decides.
TEST(ViewerSession, RestartedAndDrivenAgainComesToTheSameState) {
    const Loaded loaded = load(test::bent_tube_scene(bent("work:5000")));
    Session session(loaded.scene, loaded.prepared);
    const auto drive = [&] {
        for (int k = 0; k < 150; ++k) {
            session.apply(drive_at(k));
            session.step();
        }
        return hash_state(session.simulator().state());
    };
    const std::uint64_t first = drive();
    session.apply(Restart{});
    EXPECT_NE(hash_state(session.simulator().state()), first);
    EXPECT_EQ(drive(), first);
}

StateName named(std::string_view text) {
    StateName name{};
    std::copy(text.begin(), text.end(), name.begin());
    return name;
}

void drive_on(Session& session, int from, int to) {
    for (int k = from; k < to; ++k) {
        session.apply(drive_at(k));
        ASSERT_TRUE(session.step().finite);
    }
}

std::uint64_t hash_of(Session& session) { return hash_state(session.simulator().state()); }

TEST(ViewerSession, GoesOnFromASavedStateWithTheSameBits) {
    for (const std::string& text : {test::bent_tube_scene(bent("work:20000")), test::bent_tube_scene(bent("work:50000", test::kOrgan))}) {
        const Loaded loaded = load(text);
        Session session(loaded.scene, loaded.prepared);
        drive_on(session, 0, 60);
        session.apply(SaveState{named("in the bend")});
        const std::uint64_t there = hash_of(session);
        ASSERT_EQ(session.status().saved.count, 1u);
        const SavedMark mark = session.status().saved.marks[0];
        EXPECT_STREQ(mark.name.data(), "in the bend");
        EXPECT_EQ(mark.step, 60u);
        drive_on(session, 60, 150);
        const std::uint64_t end = hash_of(session);
        for (int round = 0; round < 2; ++round) { // what happens in between leaves no trace
            session.apply(SetBudget{{BudgetMode::Work, 0, 100}});
            session.apply(SwitchEffect{&effects::coarse_contact, false});
            if (round == 1) session.apply(Restart{});
            drive_on(session, 0, 30);
            session.apply(RestoreState{mark.id});
            EXPECT_EQ(hash_of(session), there);
            EXPECT_FALSE(session.status().stepped);
            EXPECT_TRUE(session.status().effects[index_of(effects::coarse_contact)]);
            drive_on(session, 60, 150);
            EXPECT_EQ(hash_of(session), end) << loaded.scene.name << ", round " << round;
        }
    }
}

TEST(ViewerSession, ARecordingThatGoesOnFromASavedStateRepeats) {
    const Loaded loaded = load(kOddUnits);
    Session session(loaded.scene, loaded.prepared);
    drive_on(session, 0, 40);
    session.apply(SaveState{named("a")});
    drive_on(session, 40, 70);
    session.apply(SetBudget{{BudgetMode::Work, 0, 100}});
    EXPECT_FALSE(session.recording()->repeatable());
    session.apply(RestoreState{session.status().saved.marks[0].id});
    EXPECT_EQ(session.recording()->steps(), 40u);
    EXPECT_TRUE(session.recording()->repeatable()); // the run up to there knew nothing of the change
    session.apply(Drive{-1.0, 0.3});
    for (int k = 0; k < 25; ++k) session.step();
    const std::uint64_t hash = hash_of(session);
    const std::string csv = session.recording()->text(loaded.scene, session.recording()->steps(), hash);
    EXPECT_EQ(hash_of_run(kOddUnits, csv, session.recording()->limits(), session.recording()->steps()), hash);
}

TEST(ViewerSession, KeepsSeveralStatesUnderTheirNamesAndForgetsThem) {
    const Loaded loaded = load(kOddUnits);
    Session session(loaded.scene, loaded.prepared);
    for (std::size_t k = 0; k < kMostSaved + 2; ++k) {
        session.apply(SaveState{named(fmt::format("state {}", k))});
        session.step();
    }
    ASSERT_EQ(session.status().saved.count, kMostSaved); // those after it are not kept
    session.apply(SaveState{named("state 0")});          // in place of the first
    ASSERT_EQ(session.status().saved.count, kMostSaved);
    const auto marks = session.status().saved.all();
    EXPECT_STREQ(marks.front().name.data(), "state 1");
    EXPECT_STREQ(marks.back().name.data(), "state 0");
    EXPECT_EQ(marks.back().step, kMostSaved + 2);
    session.apply(RestoreState{12345}); // there is none
    EXPECT_EQ(session.simulator().report().step, kMostSaved + 2);
    session.apply(ForgetState{marks.back().id});
    EXPECT_EQ(session.status().saved.count, kMostSaved - 1);
    session.apply(Restart{}); // they stay
    EXPECT_EQ(session.status().saved.count, kMostSaved - 1);
}

TEST(ViewerSession, ShowsSpheresOfTheLevelReached) {
    const Loaded loaded = load(test::bent_tube_scene(bent("exact")));
    Session session(loaded.scene, loaded.prepared);
    Snapshot snapshot;
    prepare_snapshot(session, snapshot);
    session.apply(Drive{1.0, 0.0});
    for (int k = 0; k < 100; ++k) session.step();
    fill_snapshot(session, true, snapshot);
    const std::size_t leaves = snapshot.spheres.size();
    EXPECT_GT(leaves, 10u);
    session.apply(SetBudget{{BudgetMode::Work, 0, 2}});
    session.step();
    fill_snapshot(session, true, snapshot);
    EXPECT_LT(snapshot.spheres.size(), leaves);
    EXPECT_TRUE(
        std::any_of(snapshot.spheres.begin(), snapshot.spheres.end(), [](const ShownSphere& s) { return s.kind == SphereKind::Assumed; }));
    fill_snapshot(session, false, snapshot);
    EXPECT_TRUE(snapshot.spheres.empty());
}

/// One thread produces, one consumes: a snapshot is whole, and never older than the one before.
TEST(ViewerLatest, IsWholeAndNeverGoesBack) {
    struct Pair {
        std::array<std::uint64_t, 64> numbers{};
    };
    Latest<Pair> latest;
    constexpr std::uint64_t kMade = 200'000;
    std::thread maker([&] {
        for (std::uint64_t k = 1; k <= kMade; ++k) {
            latest.back().numbers.fill(k);
            latest.publish();
        }
    });
    std::uint64_t last = 0, torn = 0, back = 0;
    while (last < kMade) {
        if (!latest.take()) continue;
        const Pair& seen = latest.front();
        for (const std::uint64_t number : seen.numbers) torn += number != seen.numbers[0];
        back += seen.numbers[0] <= last;
        last = seen.numbers[0];
    }
    maker.join();
    EXPECT_EQ(torn, 0u);
    EXPECT_EQ(back, 0u);
    EXPECT_FALSE(latest.take());
}

} // namespace
} // namespace trocar::engine::viewer
