// A State is all that one step leaves for the next: a copy of it (a fork), and one that went through bytes (a checkpoint), go on to the same
// bits in everything, contact forces included, whatever the scene, the step at which it is cut and the budget.
#include "engine/state/bit_hash.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/scene/scene.hpp"
#include "engine/state/state_bytes.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"
#include "step_fixture.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

namespace trocar::engine {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kSeed = 27;
constexpr int kCuts = 10, kStepsAfter = 4;
constexpr std::uint64_t kLongestRun = 240; // steps of a scene that are taken

std::vector<fs::path> shipped_scenes() {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(fs::path(TROCAR_SOURCE_DIR) / "assets/scenes"))
        if (entry.path().extension() == ".json") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

/// What a step came to, times left out.
struct Step {
    std::uint64_t state = 0, contacts = 0, contact_bits = 0, work = 0;
    double force = 0.0, friction = 0.0, residual = 0.0, kinetic = 0.0, elastic = 0.0;
    bool operator==(const Step&) const = default;
};

/// Every number of every contact.
std::uint64_t hash_contacts(std::span<const Contact> contacts) {
    BitHash hash;
    for (const Contact& c : contacts) {
        for (const std::uint64_t id : {std::uint64_t{c.a.code()}, std::uint64_t{c.b.code()}, static_cast<std::uint64_t>(c.origin)}) hash.add(id);
        for (const Index feature : c.feature_a) hash.add(std::uint64_t{feature});
        for (const Index feature : c.feature_b) hash.add(std::uint64_t{feature});
        for (const double weight : c.bary_a) hash.add(weight);
        for (const double weight : c.bary_b) hash.add(weight);
        hash.add(c.time), hash.add(c.gap), hash.add(c.normal), hash.add(c.point);
    }
    return hash.value();
}

Step take_step(Simulator& simulator) {
    const StepReport report = simulator.step();
    EXPECT_TRUE(report.finite) << report.failure;
    return {hash_whole_state(simulator.state()), simulator.contacts().size(), hash_contacts(simulator.contacts()), report.work_units,
            report.contact_force_n, report.friction_force_n, report.residual_n, report.kinetic_j, report.elastic_j};
}

class ShippedScene : public ::testing::TestWithParam<fs::path> {};

TEST_P(ShippedScene, GoesOnToTheSameBitsFromAForkARestoredStateAndItsBytes) {
    const Result<Scene> scene = read_scene(GetParam());
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    const Result<PreparedScene> prepared = make_prepared_scene(*scene, {});
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    const SceneModel& model = prepared->model;
    std::mt19937 random(kSeed);
    const BudgetLimits limits{.mode = BudgetMode::Work, .work_units = 20000};
    const std::uint64_t last = std::min(kLongestRun, model.step_count);
    std::vector<std::uint64_t> cuts;
    for (int k = 0; k < kCuts; ++k) cuts.push_back(random() % last);
    std::sort(cuts.begin(), cuts.end());
    Simulator whole(model, limits), fork(model, limits), reader(model, limits);
    std::size_t contacts = 0;
    for (const std::uint64_t cut : cuts) {
        while (whole.state().step < cut) ASSERT_TRUE(whole.step().finite);
        SCOPED_TRACE(fmt::format("{}, cut after step {}, seed {}", GetParam().filename().string(), cut, kSeed));
        const State kept = whole.state();
        std::string bytes;
        append_state(kept, bytes);
        ASSERT_TRUE(fork.restore(kept).ok());
        Simulator own = whole.fork();
        EXPECT_EQ(hash_contacts(own.contacts()), hash_contacts(whole.contacts()));
        const Result<State> read = read_state(model, bytes);
        ASSERT_TRUE(read.ok()) << read.error().message;
        ASSERT_EQ(hash_whole_state(*read), hash_whole_state(kept));
        ASSERT_TRUE(reader.restore(*read).ok());
        std::vector<Step> steps;
        for (int k = 0; k < kStepsAfter; ++k) {
            steps.push_back(take_step(whole));
            EXPECT_EQ(take_step(fork), steps.back()) << "restored from a copy, " << k;
            EXPECT_EQ(take_step(own), steps.back()) << "fork, " << k;
            EXPECT_EQ(take_step(reader), steps.back()) << "from bytes, " << k;
            contacts += steps.back().contacts;
        }
        ASSERT_TRUE(whole.restore(kept).ok()); // back, and forth again
        for (const Step& step : steps) EXPECT_EQ(take_step(whole), step) << "restored";
        if (HasFailure()) return;
    }
    RecordProperty("contacts", static_cast<int>(contacts));
}
INSTANTIATE_TEST_SUITE_P(All, ShippedScene, ::testing::ValuesIn(shipped_scenes()),
                         [](const auto& tested) { return tested.param.stem().string(); });

} // namespace
} // namespace trocar::engine
