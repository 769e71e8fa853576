// Records of the clock's decisions: written, read back, refused when they are not whole, and replayed bit for bit.
#include "engine/report/grant_record.hpp"
#include "engine/step/model_hash.hpp"
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

/// Every reading is later by an irregular amount: a busy machine.
class RestlessClock final : public Clock {
public:
    explicit RestlessClock(std::uint64_t seed) : seed_(seed) {}
    [[nodiscard]] std::int64_t now_ns() const noexcept override {
        seed_ = seed_ * 6364136223846793005ULL + 1442695040888963407ULL;
        const std::uint64_t draw = seed_ >> 54; // 0..1023
        now_ += 2'000 + static_cast<std::int64_t>(draw == 0 ? 3'000'000 : draw * 40);
        return now_;
    }

private:
    mutable std::uint64_t seed_;
    mutable std::int64_t now_ = 0;
};

GrantRecord record_run(const SceneModel& model, const BudgetLimits& limits, std::uint64_t seed, int steps) {
    const RestlessClock clock(seed);
    Simulator simulator(model, clock, limits);
    GrantRecord record;
    record.model_hash = hash_model(model);
    record.scene = model.name;
    record.limits = limits;
    for (int k = 0; k < steps; ++k) {
        simulator.tape().record_into(&record.steps.emplace_back().decisions);
        record.steps.back().fingerprint = fingerprint_of(simulator.step());
    }
    record.state_hash = hash_state(simulator.state());
    return record;
}

GrantRecord small_record() {
    GrantRecord record;
    record.model_hash = 0xabc;
    record.scene = "a name, with\nall sorts";
    record.limits = {BudgetMode::Wall, 0.1 + 0.2, 0};
    record.covers_step = true;
    record.state_hash = 0x123456789abcdef0ULL;
    record.steps = {{1, {{DecisionKind::Descent, 4096}, {DecisionKind::Fits, 1}, {DecisionKind::Round, 1}, {DecisionKind::Tests, 77}}},
                    {2, {}},
                    {~std::uint64_t{0}, {{DecisionKind::Drop, 3}, {DecisionKind::Descent, ~std::uint64_t{0}}}}};
    return record;
}

TEST(GrantRecord, IsReadBackAsItWasWritten) {
    const GrantRecord record = small_record();
    const auto back = parse_grant_record(grant_record_text(record), "grants.txt");
    ASSERT_TRUE(back.ok()) << back.error().to_string();
    EXPECT_EQ(back->model_hash, record.model_hash);
    EXPECT_EQ(back->scene, "a name, with all sorts");
    EXPECT_EQ(back->limits.wall_s, record.limits.wall_s) << "to the last bit";
    EXPECT_TRUE(back->covers_step);
    EXPECT_EQ(back->state_hash, record.state_hash);
    ASSERT_EQ(back->steps.size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(back->steps[k].fingerprint, record.steps[k].fingerprint);
        EXPECT_EQ(back->steps[k].decisions, record.steps[k].decisions);
    }
}

TEST(GrantRecord, ThatWasCutOffAnywhereIsRefused) {
    const std::string whole = grant_record_text(small_record());
    for (std::size_t length = 0; length < whole.size(); ++length)
        EXPECT_FALSE(parse_grant_record(whole.substr(0, length), "grants.txt").ok()) << length << " of " << whole.size();
    EXPECT_FALSE(parse_grant_record(whole + "x", "grants.txt").ok());
}

TEST(GrantRecord, InWhichOneByteWasChangedIsRefused) {
    const std::string whole = grant_record_text(small_record());
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::string changed = whole;
        changed[at] = changed[at] == '1' ? '2' : '1';
        EXPECT_FALSE(parse_grant_record(changed, "grants.txt").ok()) << "byte " << at;
    }
}

TEST(GrantRecord, OfAnotherKindOrVersionSaysSo) {
    const auto foreign = parse_grant_record("{\"a\": 1}\n", "x.json");
    ASSERT_FALSE(foreign.ok());
    EXPECT_NE(foreign.error().to_string().find("x.json:1"), std::string::npos);
    const auto newer = parse_grant_record("trocar-grants 5\n", "x.txt");
    ASSERT_FALSE(newer.ok());
    EXPECT_NE(newer.error().message.find("another version"), std::string::npos);
    EXPECT_FALSE(parse_grant_record("", "x.txt").ok());
    EXPECT_FALSE(parse_grant_record(std::string(1000, '\0'), "x.txt").ok());
}

TEST(Replay, OfAWallRunHasTheSameBitsWhateverTheClockSaysNow) {
    bool started = false, refused = false;
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({.host_body = test::kOrgan}));
    for (const double wall_s : {0.1e-3, 0.5e-3, 1e-3, 4e-3}) {
        const GrantRecord record = record_run(prepared.model, {BudgetMode::Wall, wall_s, 0}, 7, 100);
        for (const GrantStep& step : record.steps)
            for (const Decision& decision : step.decisions) {
                started = started || decision == Decision{DecisionKind::Fits, 1};
                refused = refused || decision == Decision{DecisionKind::Fits, 0};
            }
        Simulator again(prepared.model, record.limits); // on the real clock
        for (std::size_t k = 0; k < record.steps.size(); ++k) {
            again.tape().replay(record.steps[k].decisions);
            ASSERT_EQ(fingerprint_of(again.step()), record.steps[k].fingerprint) << "step " << k + 1;
            ASSERT_FALSE(again.tape().left_script()) << "step " << k + 1;
        }
        EXPECT_EQ(hash_state(again.state()), record.state_hash) << wall_s;
    }
    EXPECT_TRUE(started && refused) << "the clock must have decided something";
}

TEST(Replay, OfAnotherClockIsAnotherRun) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene());
    const GrantRecord a = record_run(prepared.model, {BudgetMode::Wall, 1.5e-3, 0}, 7, 60);
    const GrantRecord b = record_run(prepared.model, {BudgetMode::Wall, 1.5e-3, 0}, 8, 60);
    EXPECT_NE(grant_record_text(a), grant_record_text(b)) << "or the test above shows nothing";
}

TEST(ModelHash, IsThatOfTheSceneAndNotOfItsBudget) {
    const std::uint64_t tube = hash_model(test::prepare(test::bent_tube_scene()).model);
    EXPECT_EQ(hash_model(test::prepare(test::bent_tube_scene()).model), tube);
    EXPECT_EQ(hash_model(test::prepare(test::bent_tube_scene({.budget = "1ms"})).model), tube);
    EXPECT_NE(hash_model(test::prepare(test::bent_tube_scene({.speed = 34.0})).model), tube);
    EXPECT_NE(hash_model(test::prepare(test::bent_tube_scene({.effects = R"("coarse_contact")"})).model), tube);
    EXPECT_NE(hash_model(test::prepare(test::bent_tube_scene({.host_body = test::kOrgan})).model), tube);
}

} // namespace
} // namespace trocar::engine
