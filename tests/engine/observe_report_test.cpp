#include "observe_fixture.hpp"

#include "engine/report/html.hpp"
#include "engine/report/outline.hpp"
#include "engine/report/places.hpp"
#include "engine/report/plots.hpp"
#include "engine/report/verdict.hpp"

#include "assets/anatomy/shapes.hpp"
#include "engine/render/renderer.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <random>

namespace trocar::engine::test {

using ::testing::HasSubstr;
using ::testing::Not;

namespace {

/// A scene like the tube's with other pieces of text.
std::string changed(std::initializer_list<std::pair<std::string, std::string>> pieces) {
    std::string text = kTubeScene;
    for (const auto& [piece, other] : pieces) {
        const std::size_t at = text.find(piece);
        EXPECT_NE(at, std::string::npos) << piece;
        text.replace(at, piece.size(), other);
    }
    return text;
}

RunRecord record_of(const TinyRun& run, RunStatistics& statistics) {
    return {.scene = run.scene, .prepared = run.prepared, .statistics = statistics};
}

bool have(const char* program) { return find_program(program, "").ok(); }

} // namespace

class Report : public Folder {};

TEST_F(Report, IsOnePageThatLoadsNothing) {
    ASSERT_TRUE(tube_run().into(out, 20).ok());
    const std::string page = text_of("report.html");
    for (const char* outside : {"http:", "https:", "<script src", "<link", "url(", "@import", "fetch("}) {
        std::string rest = page; // names of XML languages are no addresses to load
        for (const char* name : {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"})
            for (std::size_t at = rest.find(name); at != std::string::npos; at = rest.find(name)) rest.erase(at, std::string(name).size());
        EXPECT_THAT(rest, Not(HasSubstr(outside)));
    }
    EXPECT_THAT(page, HasSubstr("name=\"viewport\""));
}

TEST_F(Report, SaysFirstWhetherTheBudgetWasKeptAndWhatItIsFor) {
    ASSERT_TRUE(TinyRun(changed({{R"({"limit": "exact"})", R"({"limit": "10s"})"}})).into(out, 5).ok());
    EXPECT_THAT(text_of("report.html"), HasSubstr("<h1>Collision detection kept the budget of 10000 ms in all 5 steps"));
    EXPECT_THAT(text_of("report.html"), HasSubstr("%</small></b><span>whole steps within real time"));
}

TEST_F(Report, EscapesTextOfTheScene) {
    ASSERT_TRUE(tube_run().into(out, 2).ok());
    const std::string page = text_of("report.html");
    EXPECT_THAT(page, HasSubstr("tube &amp; &lt;wire&gt;"));
    EXPECT_THAT(page, Not(HasSubstr("<wire>")));
}

TEST_F(Report, CarriesPlotsWhereGnuplotIs) {
    if (!have("gnuplot")) GTEST_SKIP() << "gnuplot is not installed: apt-get install gnuplot-nox";
    std::vector<std::string> notices;
    ASSERT_TRUE(tube_run().into(out, 20, false, false, &notices).ok());
    EXPECT_TRUE(notices.empty()) << notices.front();
    const std::string page = text_of("report.html");
    EXPECT_THAT(page, HasSubstr("<svg"));
    EXPECT_THAT(page, HasSubstr("id=\"times_gnuplot_plot_1"));
    EXPECT_THAT(page, Not(HasSubstr("<?xml")));
}

TEST_F(Report, LetsEveryPlotBeSavedAndLeavesConstantOnesOut) {
    if (!have("gnuplot")) GTEST_SKIP() << "gnuplot is not installed: apt-get install gnuplot-nox";
    ASSERT_TRUE(tube_run().into(out, 20).ok());
    const std::string page = text_of("report.html");
    const auto count = [&](const std::string& piece) {
        std::size_t found = 0;
        for (std::size_t at = page.find(piece); at != std::string::npos; at = page.find(piece, at + 1)) ++found;
        return found;
    };
    EXPECT_GE(count("<figure data-plot="), 3u);
    EXPECT_EQ(count("onclick=\"saveSvg(this)\""), count("<figure data-plot="));
    EXPECT_EQ(count("onclick=\"saveCsv(this)\""), count("<figure data-plot="));
    EXPECT_EQ(count("data-file=\"curve.tsv\""), 1u) << "data that several plots share stands in the page once";
    EXPECT_EQ(count("data-plot=\"volume\""), 0u) << "nothing deforms";
    EXPECT_EQ(count("data-plot=\"advance\""), 1u) << "the wire advances";
    EXPECT_THAT(page, HasSubstr("time of a step [ms]"));
    EXPECT_THAT(page, HasSubstr("length [mm]"));
}

TEST_F(Report, AndSummaryNameProgramCommitSceneMachineAndCommand) {
    ASSERT_TRUE(tube_run().into(out, 3).ok());
    const nlohmann::json json = summary();
    for (const char* key : {"version", "commit", "model_hash", "machine", "command"}) EXPECT_TRUE(json.contains(key)) << key;
    const std::string page = text_of("report.html");
    for (const char* key : {"version", "model_hash"}) EXPECT_THAT(page, HasSubstr(json[key].get<std::string>())) << key;
    EXPECT_EQ(json["model_hash"].get<std::string>().size(), 16u);
}

TEST_F(Report, ComesWithATableAndANoticeWhereGnuplotIsNot) {
    const std::string path = std::getenv("PATH");
    ASSERT_EQ(setenv("PATH", "/nowhere", 1), 0);
    std::vector<std::string> notices;
    const auto done = tube_run().into(out, 20, false, false, &notices);
    setenv("PATH", path.c_str(), 1);
    ASSERT_TRUE(done.ok());
    ASSERT_EQ(notices.size(), 1u);
    EXPECT_THAT(notices[0], HasSubstr("gnuplot"));
    const std::string page = text_of("report.html");
    EXPECT_THAT(page, Not(HasSubstr("<svg")));
    EXPECT_THAT(page, HasSubstr("whole step [ms]"));
    EXPECT_EQ(summary()["notices"].size(), 1u);
}

TEST_F(Report, ShowsThePicturesThatTheSceneAsksFor) {
    const TinyRun run(changed({{R"("effects": ["coarse_contact", "exact_contact"])",
                                R"("effects": ["coarse_contact", "exact_contact", "fluoroscopy"],
                               "outputs": {"size": [160, 96], "pictures": [{"view": "anatomy", "time": 0}, {"view": "tip", "time": 0.05},
                                           {"view": "anatomy", "time": 0.2}, {"view": "anatomy", "time": 0.19}, {"view": "tip", "time": 0.1},
                                           {"view": "tip", "time": 0.2}]})"}}));
    std::vector<std::string> notices;
    ASSERT_TRUE(run.into(out, 10, false, false, &notices).ok());
    if (!Renderer::make().ok()) {
        ASSERT_FALSE(notices.empty());
        EXPECT_THAT(notices[0], HasSubstr("no pictures"));
        GTEST_SKIP() << notices[0];
    }
    const nlohmann::json expected{"anatomy_01_t00.00s.png", "tip_02_t00.05s.png", "tip_03_t00.10s.png", "anatomy_04_t00.10s.png", "fluoro_05_t00.10s.png"};
    EXPECT_EQ(summary()["pictures"], expected) << "what was due after the end is taken at the end, once a view, and no view of that moment twice";
    for (const std::string name : expected) EXPECT_EQ(text_of(name).substr(1, 3), "PNG") << name;
    const std::string page = text_of("report.html");
    std::size_t images = 0;
    for (std::size_t at = page.find("data:image/png;base64,"); at != std::string::npos; at = page.find("data:image/png;base64,", at + 1))
        ++images;
    EXPECT_EQ(images, 5u);
}

TEST(Verdicts, TellMissedDeadlinesAndWhatEachLossMeans) {
    const TinyRun run(changed({{R"({"limit": "exact"})", R"({"limit": "2ms"})"}}));
    RunStatistics statistics;
    StepReport report;
    for (int k = 0; k < 1000; ++k) {
        report.ms.budget = k == 7 ? 3.5 : 1.0;
        report.budget_kept = k != 7;
        report.exact_ran = k % 10 != 0;
        report.assumed = k % 10 == 0 ? 4 : 0;
        report.lumen_exits = 0;
        statistics.add(report, 2.0, 0);
    }
    RunRecord record = record_of(run, statistics);
    make_run_summary(record, 10.0, 5.0, 0);
    const Verdict verdict = make_verdict(record);
    EXPECT_EQ(verdict.headline, "Collision detection missed the budget of 2 ms in 1 of 1000 steps (0.1 %); 100 % of the steps ended within the 10 ms they simulate.");
    EXPECT_THAT(verdict.detail, HasSubstr("1.5 ms at worst"));
    EXPECT_EQ(verdict.mark, Mark::Note);
    std::string all;
    for (const Loss& loss : list_losses(record)) all += loss.name + ": " + loss.amount + "\n";
    EXPECT_THAT(all, HasSubstr("Exact contacts skipped: in 100 of 1000 steps"));
    EXPECT_THAT(all, HasSubstr("Assumed contacts: 400 untested sphere pairs"));
    EXPECT_THAT(all, HasSubstr("Instrument outside the lumen: none"));
}

/// Steps of 10 ms, each within its 33 ms of collision detection; the first `slow` of them took longer than they simulate.
RunStatistics steps_of_which_are_slow(int slow, int count) {
    RunStatistics statistics;
    StepReport report;
    for (int k = 0; k < count; ++k) {
        report.ms.budget = 1.0;
        report.ms.total = k < slow ? 12.5 : 10.0;
        statistics.add(report, 33.0, 0);
    }
    return statistics;
}

TEST(Verdicts, NeverRoundAShareUp) {
    std::mt19937_64 random(5);
    for (int k = 0; k < 20000; ++k) {
        const auto all = 1 + random() % 1'000'000, kept = random() % (all + 1);
        const double share = static_cast<double>(kept) / static_cast<double>(all), percent = percent_of(share);
        ASSERT_EQ(percent == 100.0, kept == all) << kept << " of " << all;
        ASSERT_NEAR(percent, 100.0 * share - 0.005, 0.005 + 1e-9) << kept << " of " << all;
    }
    for (int hundredths = 0; hundredths <= 10000; ++hundredths) EXPECT_NEAR(percent_of(hundredths / 10000.0), hundredths / 100.0, 1e-12);
}

TEST(Verdicts, TellWholeStepsThatWereSlowerThanRealTimeApartFromTheBudget) {
    for (const bool covers_step : {false, true}) {
        TinyRun run(changed({{R"({"limit": "exact"})", covers_step ? R"({"limit": "33ms", "scope": "step"})" : R"({"limit": "33ms"})"}}));
        const std::string who = covers_step ? "Whole steps" : "Collision detection";
        RunStatistics statistics = steps_of_which_are_slow(8, 600);
        RunRecord record = record_of(run, statistics);
        make_run_summary(record, 6.0, 6.0, 0);
        EXPECT_EQ(record.summary.budget_kept, 1.0);
        EXPECT_EQ(record.summary.realtime_overruns, 8u);
        EXPECT_DOUBLE_EQ(record.summary.realtime_kept, 592.0 / 600.0);
        const Verdict verdict = make_verdict(record);
        EXPECT_EQ(verdict.headline, who + " kept the budget of 33 ms in all 600 steps; 98.66 % of the steps ended within the 10 ms they simulate.") << "never rounded up";
        EXPECT_THAT(verdict.detail, HasSubstr("8 of 600 steps took longer than the 10 ms that each simulates: 98.66 %"));
        EXPECT_EQ(verdict.mark, Mark::Note);
        std::string all;
        for (const Loss& loss : list_losses(record)) all += loss.name + ": " + loss.amount + "\n";
        EXPECT_THAT(all, HasSubstr("Steps over the budget: none"));
        EXPECT_THAT(all, HasSubstr("Whole steps slower than real time: 8 of 600 steps, 12.5 ms the slowest"));
    }
    RunStatistics statistics = steps_of_which_are_slow(0, 600);
    RunRecord record = record_of(tube_run(), statistics);
    make_run_summary(record, 6.0, 6.0, 0);
    EXPECT_EQ(record.summary.realtime_kept, 1.0) << "a step that takes as long as it simulates is in time";
    EXPECT_THAT(make_verdict(record).detail, HasSubstr("No whole step took longer than the 10 ms it simulates."));
}

TEST(Verdicts, AreBadWhenTheInstrumentLeftTheLumen) {
    RunStatistics statistics;
    StepReport report;
    report.lumen_exits = 3;
    statistics.add(report, 1e9, 0);
    RunRecord record = record_of(tube_run(), statistics);
    make_run_summary(record, 0.01, 0.01, 0);
    EXPECT_EQ(make_verdict(record).mark, Mark::Bad);
}

TEST(Html, MakesEveryTextHarmless) {
    EXPECT_EQ(escape_html("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
    EXPECT_EQ(escape_html("h\xC3\xA9patique \xE8\x82\x9D"), "h\xC3\xA9patique \xE8\x82\x9D");
    EXPECT_EQ(escape_html("\xFF\x01"), "\xEF\xBF\xBD\xEF\xBF\xBD");
    EXPECT_EQ(escape_html("\xC3"), "\xEF\xBF\xBD");    // cut off
    EXPECT_EQ(escape_html("\xED\xA0\x80").size(), 9u); // a surrogate, three bad bytes
}

TEST(Base64, AgreesWithTheStandardsExamples) {
    const char* const examples[][2] = {{"", ""},        {"f", "Zg=="},        {"fo", "Zm8="},
                                       {"foo", "Zm9v"}, {"foob", "Zm9vYg=="}, {"foobar", "Zm9vYmFy"}};
    for (const auto& [plain, coded] : examples) EXPECT_EQ(encode_base64(plain), coded);
    EXPECT_EQ(encode_base64("\xFF\xFE"), "//4=");
}

TEST(Shell, WordsAreQuotedOnlyWhereTheyMust) {
    EXPECT_EQ(shell_quoted("assets/scenes/hepatic.json"), "assets/scenes/hepatic.json");
    EXPECT_EQ(shell_quoted("my scene's.json"), "'my scene'\\''s.json'");
    EXPECT_EQ(shell_quoted(""), "''");
}

TEST(Outline, OfABoxFromTheFrontIsItsRim) {
    const TriMesh box = anatomy::make_box(Vec3::Zero(), Vec3(1.0, 1.0, 1.0), 2);
    const std::vector<OutlineEdge> rim = find_outline(box, Vec3(0.1, -1.0, 0.05).normalized());
    ASSERT_FALSE(rim.empty());
    for (const OutlineEdge& edge : rim) { // on edges of the box: two coordinates at their ends
        const auto at_end = [](double a, double b) { return a == b && std::abs(std::abs(a) - 0.5) < 1e-12; };
        int ends = 0;
        for (int axis = 0; axis < 3; ++axis) ends += at_end(edge.a[axis], edge.b[axis]);
        EXPECT_GE(ends, 2);
    }
}

} // namespace trocar::engine::test
