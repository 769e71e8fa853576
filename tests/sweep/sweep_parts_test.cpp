// Reductions, CSV, ranges and draws; the published schema and page. TROCAR_WRITE_GENERATED=1 writes them instead of comparing.
#include "engine/io/csv.hpp"
#include "engine/experiments/sweep/draws.hpp"
#include "engine/experiments/sweep/reduction.hpp"
#include "engine/scene/override.hpp"
#include "sweep_fixture.hpp"

#include <cmath>
#include <limits>

namespace trocar::engine {
namespace {

TEST(Reduction, TakesWhatItsNameSays) {
    const std::vector<double> values{3.0, -1.0, 2.0, 2.0};
    EXPECT_EQ(reduce("max", values), 3.0);
    EXPECT_EQ(reduce("min", values), -1.0);
    EXPECT_EQ(reduce("mean", values), 1.5);
    EXPECT_EQ(reduce("sum", values), 6.0);
    EXPECT_EQ(reduce("first", values), 3.0);
    EXPECT_EQ(reduce("last", values), 2.0);
    EXPECT_EQ(reduce("count", values), 4.0);
    EXPECT_EQ(reduce("p50", values), 2.0);
    EXPECT_EQ(reduce("p99", values), 3.0);
    EXPECT_EQ(reduce("p1", values), -1.0);
}

TEST(Reduction, OfNothingIsNothingAndANanIsNotLost) {
    EXPECT_FALSE(reduce("max", {}));
    EXPECT_FALSE(reduce("median", {1.0}));
    for (const std::string_view name : reduction_names())
        if (name != "count") EXPECT_TRUE(std::isnan(*reduce(name, {1.0, std::numeric_limits<double>::quiet_NaN(), 2.0}))) << name;
}

TEST(Reduction, ReadsAColumnByItsName) {
    EXPECT_EQ(column_values("step,a,b\n1,2,inf\n2,4,5\n", "a"), (std::vector<double>{2.0, 4.0}));
    EXPECT_TRUE(std::isinf(column_values("step,a,b\n1,2,inf\n", "b")->front()));
    EXPECT_FALSE(column_values("step,a\n1,2\n", "c"));
    EXPECT_FALSE(column_values("step,a\n1,x\n", "a"));
    EXPECT_FALSE(column_values("", "a"));
    EXPECT_TRUE(column_values("a\n", "a")->empty());
}

TEST(Csv, QuotedCellsReadBack) {
    const std::string awkward = "a \"b\", c\nd";
    const auto rows = read_csv("x," + csv_cell(awkward) + "\r\n\n,\n1,2");
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_EQ(rows[0].cells, (std::vector<std::string>{"x", awkward}));
    EXPECT_EQ(rows[1].cells, (std::vector<std::string>{"", ""}));
    EXPECT_EQ(rows[2].cells, (std::vector<std::string>{"1", "2"}));
    EXPECT_EQ(rows[2].line, 5u);
    EXPECT_EQ(rows[2].places[1].column, 3u);
    const auto places = read_csv("\xEF\xBB\xBF\xc3\xa4,\"a\nb\",c\n")[0].places;
    EXPECT_EQ(places[1].column, 3u) << "columns count characters";
    EXPECT_EQ(places[2].line, 2u);
    EXPECT_EQ(places[2].column, 4u);
    EXPECT_EQ(read_csv("\"never closed").size(), 1u);
}

TEST(Csv, AQuoteThatIsNeverClosedIsAnErrorOfTheFileWhereItOpens) {
    const auto cut = read_csv("a,b\n1,\"2\"\n3,\"4\n5,6\n", "rows.csv");
    ASSERT_FALSE(cut.ok());
    EXPECT_EQ(cut.error().to_string().find("rows.csv:3:3: found a quote that is never closed; expected "), 0u) << cut.error().to_string();
    EXPECT_FALSE(read_csv("\"a\"\"", "rows.csv").ok()) << "two quotes in a cell are one of its characters";
    const auto closed = read_csv("a,\"b \"\"c\"\"\"\n", "rows.csv");
    ASSERT_TRUE(closed.ok());
    EXPECT_EQ((*closed)[0].cells, (std::vector<std::string>{"a", "b \"c\""}));
}

TEST(Range, HoldsItsEndsAndRoundNumbersBetween) {
    EXPECT_EQ(range_values(0.0, 0.3, 4, false), (std::vector<std::string>{"0", "0.1", "0.2", "0.3"}));
    EXPECT_EQ(range_values(0.001, 10.0, 5, true), (std::vector<std::string>{"0.001", "0.01", "0.1", "1", "10"}));
    EXPECT_EQ(range_values(2.0, 5.0, 1, false), (std::vector<std::string>{"2"}));
    EXPECT_EQ(range_values(3.0, 1.0, 3, false), (std::vector<std::string>{"3", "2", "1"})) << "a falling one";
    EXPECT_EQ(range_values(100.0, 1.0, 3, true), (std::vector<std::string>{"100", "10", "1"}));
    EXPECT_EQ(range_values(9007199254740989.0, 9007199254740991.0, 3, false),
              (std::vector<std::string>{"9007199254740989", "9007199254740990", "9007199254740991"})) << "seeds of many digits";
}

TEST(Draw, IsTheSameEverywhereAndKnowsItsPointer) {
    DrawStream a(1, "/x"), b(1, "/x"), c(1, "/y"), d(2, "/x");
    const double first = a.uniform();
    EXPECT_EQ(first, b.uniform());
    EXPECT_NE(first, c.uniform());
    EXPECT_NE(first, d.uniform());
    EXPECT_EQ(number_json(DrawStream(7, "/instruments/wire/friction").uniform()), number_json(DrawStream(7, "/instruments/wire/friction").uniform()));
}

TEST(Draw, HasTheMomentsOfItsDistribution) {
    DrawStream stream(3, "/x");
    double sum = 0.0, squares = 0.0, uniform = 0.0;
    std::vector<int> counts(7);
    constexpr int kCount = 20000;
    for (int i = 0; i < kCount; ++i) {
        const double x = stream.normal();
        sum += x;
        squares += x * x;
        uniform += stream.uniform();
        ++counts[stream.below(7)];
    }
    EXPECT_NEAR(sum / kCount, 0.0, 0.03);
    EXPECT_NEAR(squares / kCount, 1.0, 0.05);
    EXPECT_NEAR(uniform / kCount, 0.5, 0.01);
    for (const int count : counts) EXPECT_NEAR(count, kCount / 7, 250);
}

TEST(Override, PutsAValueWhereTheSchemaAllowsIt) {
    const auto set = [](const std::string& setting) {
        const auto override = parse_override(setting);
        EXPECT_TRUE(override.ok());
        return parse_scene(kBall, "ball.json", std::vector<SceneOverride>{*override});
    };
    EXPECT_EQ(set("/bodies/ball/surface/radius=12")->settings.front(), "/bodies/ball/surface/radius=12");
    EXPECT_EQ(set("/budget=work:7")->budget.to_string(), "work:7") << "the scene has no budget";
    EXPECT_EQ(set("/budget/limit=work:8")->budget.to_string(), "work:8") << "nor an object there";
    EXPECT_TRUE(set("/targets/end/position/2=5").ok());
    EXPECT_DOUBLE_EQ(set("/contact/margin=2")->contact.margin, 0.002);
}

TEST(Override, NamesWhatItDoesNotFind) {
    const auto fails = [](const std::string& setting, const std::string& piece) {
        const auto override = parse_override(setting);
        EXPECT_TRUE(override.ok());
        const auto scene = parse_scene(kBall, "ball.json", std::vector<SceneOverride>{*override});
        ASSERT_FALSE(scene.ok()) << setting;
        EXPECT_NE(scene.error().to_string().find(piece), std::string::npos) << scene.error().to_string();
    };
    fails("/bodys=1", "\"bodies\"");
    fails("/bodies/bal/kind=static", "\"ball\"");
    fails("/bodies/ball/surface/radius/0=1", "pointer to end there");
    fails("/effects/friction=true", "from 0 to 0");
    fails("/targets/end/position/3=1", "from 0 to 2");
    fails("/targets/end/position/-=1", "from 0 to 2");
    fails("/targets/end/position/00=1", "from 0 to 2");
    fails("/bodies/ball/surface/radius=-3", "given for /bodies/ball/surface/radius");
    fails("/bodies/ball/surface=null", "bodies.ball.surface");
    fails("/=1", "key");
    EXPECT_FALSE(parse_override("budget=1").ok());
    EXPECT_FALSE(parse_override("/budget").ok());
    EXPECT_FALSE(parse_override("/x=[1").ok());
    EXPECT_FALSE(split_pointer("/a~").ok());
    EXPECT_FALSE(split_pointer(std::string(100, '/')).ok());
    EXPECT_EQ(*split_pointer("/a~1b/~0"), (std::vector<std::string>{"a/b", "~"}));
}

void expect_published(const std::filesystem::path& file, const std::string& text) {
    if (std::getenv("TROCAR_WRITE_GENERATED") != nullptr) std::ofstream(file, std::ios::binary) << text;
    EXPECT_TRUE(text_of(file) == text) << file << " is out of date; run this test with TROCAR_WRITE_GENERATED=1";
}

TEST(SweepSchema, IsTheOneThatIsPublished) {
    const std::filesystem::path source = TROCAR_SOURCE_DIR;
    expect_published(source / "assets" / "sweep.schema.json", sweep_schema_text());
    expect_published(source / "docs" / "sweep.md", sweep_reference_markdown());
}

TEST(ShippedSweeps, AreReadAndPlannedAsTheyLie) {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TROCAR_SOURCE_DIR) / "assets" / "sweeps")) {
        const auto spec = read_sweep(entry.path());
        ASSERT_TRUE(spec.ok()) << spec.error().to_string();
        const auto plan = make_plan(*spec);
        ASSERT_TRUE(plan.ok()) << plan.error().to_string();
        EXPECT_GE(plan->run_count(), 48u) << entry.path();
        ++count;
    }
    EXPECT_EQ(count, 3u);
}

} // namespace
} // namespace trocar::engine
