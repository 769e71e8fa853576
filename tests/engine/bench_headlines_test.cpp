// The short version of the benches: made of their rows, with nothing where a row or a peer is missing.
#include "bench/bench.hpp"
#include "bench/benchmark_page.hpp"
#include "bench/headlines.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/prepare/process.hpp"
#include "engine/time/date.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace trocar::engine {
namespace {

BenchTable table_of(const char* rows) {
    BenchTable table;
    for (const auto& row : nlohmann::ordered_json::parse(rows)) table.rows.push_back(row);
    return table;
}

TEST(Headlines, GiveTheFactorToAPeerOfTheSameRun) {
    const BenchTable with = table_of(R"json([
        {"name": "bar_5k", "law": "neo_hookean", "viscous": false, "ns_per_tet": 8.0, "peer": false, "isa": "avx512", "precision": "double",
         "threads": 1, "integrator": "none"},
        {"name": "bar_5k", "ns_per_tet": 64.0, "peer": true}])json");
    const auto lines = headlines_of("fem", with);
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].factor, 8.0);
    BenchTable without = with;
    without.rows.pop_back();
    EXPECT_FALSE(headlines_of("fem", without)[0].factor.has_value()) << "no peer, no factor";
    EXPECT_TRUE(headlines_of("fem", without)[0].beside.empty());
}

TEST(Headlines, SetOursBesideThePapersAndSayWhereTheShapeDiffers) {
    const auto lines = headlines_of("seed004", table_of(R"json([
        {"animation": "garment", "rigid": 34000, "cloth": 20000, "method": "R-TRI", "s_per_step": 0.14, "paper_s": 0.076},
        {"animation": "garment", "rigid": 34000, "cloth": 20000, "method": "with skipping", "s_per_step": 0.009, "paper_s": 0.052,
         "percent_of_rtri": 6.4, "percent_of_clusters_anew": 81.2, "paper_percent": 68},
        {"animation": "cones", "rigid": 1, "cloth": 2, "method": "with skipping", "s_per_step": 0.1, "paper_s": 0.2,
         "percent_of_rtri": 66, "paper_percent": 68}])json"));
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_NEAR(*lines[0].factor, 0.052 / 0.009, 1e-12);
    EXPECT_EQ(lines[0].here, "0.009 (81 %; 6 %)") << "the fair row beside the flattering one";
    EXPECT_EQ(lines[1].here, "0.1 (-; 66 %)");
    EXPECT_NE(lines[0].beside.find("quoted"), std::string::npos);
    EXPECT_FALSE(lines[0].remark.empty()) << "6 % is not 68 %";
    EXPECT_TRUE(lines[1].remark.empty()) << "66 % is";
}

TEST(Headlines, OfAQuickRunHaveNoFactorAgainstAPaperThatMeasuredAllOfIt) {
    BenchTable table = table_of(R"json([{"setup": "AABB", "refit_s": 1, "test_s": 2, "total_s": 3, "paper_refit_s": 43, "paper_test_s": 50,
        "paper_total_s": 93}])json");
    EXPECT_EQ(headlines_of("seed001", table)[0].factor, 31.0);
    table.quick = true;
    EXPECT_FALSE(headlines_of("seed001", table)[0].factor.has_value());
}

TEST(Headlines, CountBoundsAndNameThoseThatDoNotHold) {
    const auto lines =
        headlines_of("validation", table_of(R"json([{"what": "a", "holds": true}, {"what": "b", "holds": false}, {"what": "c"}])json"));
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].here, "1 of 2");
    EXPECT_EQ(lines[0].remark, "missed: b");
}

TEST(Headlines, OfThePriceNameTheBestBudgetOfAQuarterOfTheTime) {
    const auto lines = headlines_of("price", table_of(R"json([
        {"scene": "s", "budget": "work:0", "charged_of_exact": 0.01, "run_rms_mm": 8.0},
        {"scene": "s", "budget": "1ms", "charged_of_exact": 0.2, "run_rms_mm": 2.0},
        {"scene": "s", "budget": "4ms", "charged_of_exact": 0.6, "run_rms_mm": 0.1},
        {"scene": "s", "budget": "exact", "charged_of_exact": 1.0, "run_rms_mm": 0.0},
        {"scene": "t", "budget": "exact", "charged_of_exact": 1.0, "run_rms_mm": 0.0}])json"));
    ASSERT_EQ(lines.size(), 1u) << "of a scene without such a budget there is none";
    EXPECT_EQ(lines[0].here, "20 %; 25 % (2 mm)");
}

TEST(Headlines, SayWhatIsBelowTheNoise) {
    const auto lines = headlines_of("effects", table_of(R"json([
        {"scene": "s", "effect": "gravity", "saved_ms": 0.5, "noise_ms": 0.1, "saved_share": 0.25},
        {"scene": "s", "effect": "breathing", "saved_ms": -0.02, "noise_ms": 0.1, "saved_share": -0.01}])json"));
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].here, "gravity 25 %, breathing less than can be measured");
}

TEST(Headlines, OfSetsStandBesideSearchesForTheSameContactsWithStageIIForcedAndWhereItPays) {
    const auto lines = headlines_of("chromatic", table_of(R"json([
        {"scene": "s", "looked_for": "self", "method": "AABB tree, pair by pair", "total_ms": 300},
        {"scene": "s", "looked_for": "self", "method": "sets, I alone", "total_ms": 48, "pcs_after_I": 9000, "pcs_after_II": 9000},
        {"scene": "s", "looked_for": "self", "method": "sets, I and II", "total_ms": 400, "pcs_after_I": 9000, "pcs_after_II": 4000},
        {"scene": "s", "looked_for": "self", "method": "sets, I and II, fronts", "total_ms": 350, "pcs_after_I": 9000, "pcs_after_II": 3000},
        {"scene": "s", "looked_for": "self", "method": "sets, II where it pays", "total_ms": 50, "steps": 5, "steps_with_II": 1, "paper_ms": "100"},
        {"scene": "s", "looked_for": "other", "method": "AABB tree, pair by pair", "total_ms": 20},
        {"scene": "s", "looked_for": "other", "method": "this library's hierarchy", "total_ms": 5},
        {"scene": "s", "looked_for": "other", "method": "sets, II where it pays", "total_ms": 7, "steps": 5, "steps_with_II": 0}])json"));
    ASSERT_EQ(lines.size(), 3u);
    EXPECT_EQ(lines[0].here, "300.0 / 400.0 / 50.0 (1 of 5) / -");
    EXPECT_NE(lines[0].remark.find("do not beat the AABB tree"), std::string::npos) << "judged by what the paper did: stage II in every step";
    EXPECT_EQ(lines[1].here, "9000 / 4000 (2.2 times fewer)");
    EXPECT_NE(lines[1].beside.find("quoted: 6442 / 524 (12.3 times fewer)"), std::string::npos) << "the paper's reduction beside ours";
    EXPECT_EQ(lines[2].here, "20.0 / - / 7.0 (0 of 5) / 5.0");
    EXPECT_NE(lines[0].what, lines[2].what);
}

TEST(Headlines, OfFiguresThatWereNotMeasuredHereAreMarkedQuotedAndGiveNoFactor) {
    const auto trees = headlines_of("spheretree", table_of(R"json([
        {"mesh": "bunny 7K", "builder": "medial", "leaves": 508, "build_s": 2, "threads": 4, "toolkit": "493 leaves, 123 s"}])json"));
    ASSERT_EQ(trees.size(), 1u);
    EXPECT_NE(trees[0].beside.find("quoted: 493 leaves"), std::string::npos);
    EXPECT_NE(trees[0].what.find("on 4 threads"), std::string::npos);
    EXPECT_FALSE(trees[0].factor.has_value()) << "of a program that was not run";
    const auto frames = headlines_of("interruptible", table_of(R"json([
        {"bodies": "b", "order": "breadth", "open": 5, "us": 2, "missed": 0, "paper": "1 s: 1345 open"},
        {"bodies": "spikes.json, whole steps", "budget": "1ms", "steps_per_s": 123.4},
        {"bodies": "spikes.json, whole steps", "budget": "exact", "steps_per_s": 56.7}])json"));
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_EQ(frames[1].here, "123 / 57");
    EXPECT_NE(frames[1].what.find("whole steps a second"), std::string::npos);
    EXPECT_NE(frames[1].beside.find("quoted"), std::string::npos);
}

TEST(Headlines, OfImageSpaceCullingAreOneLineAMeshWithTheFastestOfEitherForm) {
    const auto lines = headlines_of("image-space", table_of(R"json([
        {"mesh": "cows", "triangles": 5, "culler": "CPU", "total_ms": 30, "crossings": 4, "paper": "p"},
        {"mesh": "cows", "triangles": 5, "culler": "card", "total_ms": 3, "crossings": 4, "paper": "p"},
        {"mesh": "cows", "triangles": 5, "culler": "as the paper, random", "total_ms": 9, "crossings": 2, "paper": "p"},
        {"mesh": "cows", "triangles": 5, "culler": "as the paper, connected", "total_ms": 8, "crossings": 1, "paper": "p"},
        {"mesh": "bunny", "triangles": 7, "culler": "CPU", "total_ms": 5, "crossings": 6, "paper": "q"}])json"));
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0].what, "cows of 5 triangles, card / as the paper, connected: ms (crossings found)");
    EXPECT_EQ(lines[0].here, "3 (4) / 8 (1)");
    EXPECT_FALSE(lines[0].remark.empty());
    EXPECT_EQ(lines[1].here, "5 (6)");
    EXPECT_TRUE(lines[1].remark.empty());
}

TEST(Headlines, OfNoRowsAreFew) {
    for (const Bench& bench : benches()) EXPECT_LE(headlines_of(bench.name, {}).size(), 1u) << bench.name;
    EXPECT_TRUE(headlines_of("none", table_of(R"json([{"a": 1}])json")).empty());
}

TEST(Headlines, EveryBenchHasThem) {
    // of rows that its own run made the keys of: a renamed key would silence a line
    const std::pair<const char*, const char*> rows[] = {
        {"deadline", R"json([{"budget_ms": 1, "kept_where_it_fits": 1, "own_ms_p999": 0.9}])json"},
        {"effects", R"json([{"scene": "s", "effect": "gravity", "saved_share": 0.1}])json"},
        {"spheretree", R"json([{"mesh": "bunny 7K", "builder": "medial", "leaves": 508, "build_s": 2, "toolkit": "t"}])json"},
        {"interruptible", R"json([{"bodies": "b", "order": "breadth", "open": 5, "us": 2, "missed": 0, "paper": "1 s: 1345 open"}])json"},
        {"contacts",
         R"json([{"workload": "cloth", "triangles": 10, "method": "x (default)", "peer": false, "threads": 1, "refit_and_broad_ms": 1, "total_ms": 2}])json"},
        {"chromatic", R"json([{"scene": "s", "method": "sets, II where it pays", "total_ms": 1, "paper_ms": "400"}])json"},
        {"seed001",
         R"json([{"setup": "AABB", "refit_s": 1, "test_s": 2, "total_s": 3, "paper_refit_s": 4, "paper_test_s": 5, "paper_total_s": 9}])json"},
        {"image-space", R"json([{"mesh": "cows", "triangles": 5, "culler": "CPU", "total_ms": 3, "crossings": 4, "paper": "p"}])json"}};
    for (const auto& [bench, text] : rows) {
        EXPECT_FALSE(headlines_of(bench, table_of(text)).empty()) << bench;
    }
}

TEST(Headlines, OfATableThatWasWrittenAreThoseOfTheTable) {
    BenchTable table = table_of(R"json([{"budget_ms": 1, "kept_where_it_fits": 0.9995, "own_ms_p999": 0.9}])json");
    table.quick = true;
    table.notes = {"a note"};
    auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    const auto file = folder->path() / "deadline.json";
    ASSERT_TRUE(write_file_atomically(file, bench_json("deadline", table).dump()).ok());
    const auto read = read_bench(file);
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(read->name, "deadline");
    EXPECT_TRUE(read->table.quick);
    EXPECT_EQ(read->table.notes, table.notes);
    EXPECT_EQ(headlines_of("deadline", read->table).front().here, headlines_of("deadline", table).front().here);
    for (const char* text : {"", "[]", "{}", R"json({"bench": 3, "rows": []})json", R"json({"bench": "x", "rows": [1]})json"}) {
        ASSERT_TRUE(write_file_atomically(file, text).ok());
        EXPECT_FALSE(read_bench(file).ok()) << text;
    }
    EXPECT_FALSE(read_bench(folder->path() / "none.json").ok());
}

TEST(Headlines, InMarkdownAreOneLineEach) {
    Bench bench{"deadline", "budgets", nullptr};
    const std::vector<MeasuredBench> measured{
        {&bench, table_of(R"json([{"budget_ms": 1, "kept_where_it_fits": 0.9995, "own_ms_p999": 0.9}])json")}};
    const std::string text = headlines_markdown(measured);
    EXPECT_NE(text.find("| 99.95 |"), std::string::npos) << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4);
    EXPECT_NE(all_benches_page(measured).find("99.95"), std::string::npos);
}

const std::string kEmptyPage = "before\n<!-- headlines: written by trocar bench --docs -->\nold\n<!-- end of headlines -->\nbetween\n"
                               "<!-- runs: written by trocar bench --docs -->\n<!-- end of runs -->\n"
                               "<!-- literature: written by trocar bench --docs -->\n<!-- end of literature -->\nafter\n";

/// A folder with a page and what two benches measured.
struct Docs {
    Docs() {
        write("benchmarks.md", kEmptyPage);
        EXPECT_TRUE(keep_measured(folder->path(), "deadline", table_of(R"json([{"budget_ms": 1, "kept_where_it_fits": 0.9995, "own_ms_p999": 0.9}])json")).ok());
        EXPECT_TRUE(keep_measured(folder->path(), "literature", table_of(R"json([{"case": "elastica", "quantity": "tip", "source": "by shooting", "reference": 0.7,
            "reference_is": "quoted", "sizes": [8, 32], "measured": [0.72, 0.71], "order": 2.0, "stated_size": 32, "error": 0.01, "met": false, "why_missed": "it bends"},
            {"case": "elastica", "quantity": "side", "source": "by shooting", "reference": 0.2, "sizes": [8], "measured": [0.2], "order": null, "met": true}])json")).ok());
    }
    void write(const std::filesystem::path& name, const std::string& text) const { ASSERT_TRUE(write_file_atomically(folder->path() / name, text).ok()); }
    [[nodiscard]] std::string read(const std::filesystem::path& name) const { return *read_file_bytes(folder->path() / name); }
    Result<TemporaryFolder> folder = TemporaryFolder::make();
};

TEST(BenchmarkPage, IsMadeOfWhatWasMeasuredAndAllElseStays) {
    const Docs docs;
    ASSERT_TRUE(write_benchmark_page(docs.folder->path()).ok());
    const std::string page = docs.read("benchmarks.md");
    EXPECT_EQ(page.find("old"), std::string::npos);
    EXPECT_NE(page.find("| 99.95 |"), std::string::npos) << page;
    EXPECT_NE(page.find("| elastica (by shooting) | tip | 0.7, quoted | 8: 0.72, **32**: 0.71 | 2.0 | 0.01 | no: it bends |\n|  | side | 0.2 | 8: 0.2 |  | 0 | yes |\n"),
              std::string::npos);
    EXPECT_NE(page.find("| `trocar bench deadline` | " + today() + " |"), std::string::npos) << "command and date of each";
    ASSERT_TRUE(write_benchmark_page(docs.folder->path()).ok());
    EXPECT_EQ(docs.read("benchmarks.md"), page) << "again, it is the same";
    for (const char* kept : {"before\n", "between\n", "after\n"}) EXPECT_NE(page.find(kept), std::string::npos);
}

/// Every value of a kept file in turn becomes something else: there is a page, or an error and no page.
TEST(BenchmarkPage, OfDamagedFilesIsWholeOrNotWritten) {
    const Docs docs;
    const nlohmann::ordered_json others[] = {nullptr, true, 3, -1e300, "text", nlohmann::ordered_json::array(), nlohmann::ordered_json::object(),
                                             nlohmann::ordered_json::array({1, "x", nullptr}), nlohmann::ordered_json::parse(R"json({"avx512": false})json")};
    std::size_t refused = 0, written = 0;
    for (const char* name : {"measured/deadline.json", "measured/literature.json"}) {
        const std::string whole = docs.read(name);
        const auto flat = nlohmann::ordered_json::parse(whole).flatten();
        std::vector<std::string> places{""};
        for (const auto& [place, value] : flat.items())
            for (std::size_t at = place.size(); at != 0; at = place.rfind('/', at - 1))
                if (std::find(places.begin(), places.end(), place.substr(0, at)) == places.end()) places.push_back(place.substr(0, at));
        for (const std::string& place : places)
            for (const auto& other : others) {
                auto json = nlohmann::ordered_json::parse(whole);
                json[nlohmann::ordered_json::json_pointer(place)] = other;
                docs.write(name, json.dump());
                docs.write("benchmarks.md", kEmptyPage);
                const bool ok = write_benchmark_page(docs.folder->path()).ok();
                ++(ok ? written : refused);
                EXPECT_EQ(docs.read("benchmarks.md") == kEmptyPage, !ok) << place << " " << other.dump();
            }
        docs.write(name, whole.substr(0, whole.size() / 2));
        EXPECT_FALSE(write_benchmark_page(docs.folder->path()).ok()) << "cut off";
        docs.write(name, whole);
    }
    EXPECT_GT(refused, 50u);
    EXPECT_GT(written, 50u);
}

TEST(BenchmarkPage, IsRefusedWhereThereIsNothingToMakeItOf) {
    const Docs docs;
    const auto refuses = [&](const char* says) {
        const auto written = write_benchmark_page(docs.folder->path());
        EXPECT_TRUE(!written.ok() && written.error().to_string().find(says) != std::string::npos) << says;
    };
    docs.write("benchmarks.md", "<!-- end of headlines -->\n<!-- headlines: written by trocar bench --docs -->\n");
    refuses("found no table \"headlines\"");
    docs.write("benchmarks.md", kEmptyPage);
    std::filesystem::remove_all(docs.folder->path() / "measured");
    refuses("found nothing measured");
    EXPECT_EQ(docs.read("benchmarks.md"), kEmptyPage);
    std::filesystem::remove(docs.folder->path() / "benchmarks.md");
    refuses("benchmarks.md");
    BenchTable quick = table_of("[]");
    quick.quick = true;
    EXPECT_FALSE(keep_measured(docs.folder->path(), "fem", quick).ok()) << "a part is no figure to show";
}

} // namespace
} // namespace trocar::engine
