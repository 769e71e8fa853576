#include "bench/bench.hpp"
#include "bench/reference_beams.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <set>
#include <string>

namespace trocar::engine {

TEST(BenchValidation, EveryBoundHoldsAndThePageHasItsPlots) {
    const auto all = benches();
    const auto bench = std::find_if(all.begin(), all.end(), [](const Bench& b) { return b.name == "validation"; });
    ASSERT_NE(bench, all.end());
    BenchOptions options;
    options.quick = true;
    const auto table = bench->run(options);
    ASSERT_TRUE(table.ok());
    EXPECT_GE(table->rows.size(), 35u);
    for (const BenchRow& row : table->rows) EXPECT_TRUE(row["holds"].get<bool>()) << row.dump();
    const std::string page = bench_page(*bench, *table);
    if (page.find("No plots") != std::string::npos) GTEST_SKIP() << "gnuplot is not installed";
    std::size_t plots = 0;
    for (std::size_t at = page.find("<svg"); at != std::string::npos; at = page.find("<svg", at + 1)) ++plots;
    EXPECT_EQ(plots, table->sketches.size());
    EXPECT_GE(plots, 5u);
}

TEST(BenchLiterature, EveryCaseOfTheQuickPartKeepsItsBoundAndHasAFigureWhereSeveralSizesRan) {
    const auto all = benches();
    const auto bench = std::find_if(all.begin(), all.end(), [](const Bench& b) { return b.name == "literature"; });
    ASSERT_NE(bench, all.end());
    BenchOptions options;
    options.quick = true;
    const auto table = bench->run(options);
    ASSERT_TRUE(table.ok());
    EXPECT_GE(table->rows.size(), 45u);
    std::set<std::string> refined;
    for (const BenchRow& row : table->rows) {
        EXPECT_TRUE(row["holds"].get<bool>()) << row.dump();
        EXPECT_TRUE(row["met"].get<bool>() || !row["why_missed"].get<std::string>().empty()) << row.dump();
        EXPECT_EQ(row["sizes"].size(), row["measured"].size()) << row.dump();
        EXPECT_FALSE(row["source"].get<std::string>().empty()) << row.dump();
        if (row["sizes"].size() > 1) refined.insert(row["case"].get<std::string>());
    }
    EXPECT_EQ(table->sketches.size(), refined.size());
    EXPECT_GE(table->sketches.size(), 12u);
    const std::string page = bench_page(*bench, *table);
    EXPECT_TRUE(page.find("<svg") != std::string::npos || page.find("No plots") != std::string::npos);
}

TEST(BenchValidation, BeamsOfOtherProgramsAreMatchedWithinTheirBounds) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr || !std::filesystem::is_directory(std::filesystem::path(data) / "fem"))
        GTEST_SKIP() << "TROCAR_TEST_DATA names no folder with fem/";
    for (const ReferenceBeam& beam : reference_beams()) {
        const auto tips = compare_beam(beam, std::filesystem::path(data) / "fem", false);
        ASSERT_TRUE(tips.ok()) << tips.error().to_string();
        EXPECT_GT(tips->ours / tips->reference, beam.least) << beam.name;
        EXPECT_LT(tips->ours / tips->reference, beam.most) << beam.name;
    }
}

TEST(BenchFem, QuickHasABarBesideItsTargetsAndTheCostOverMeshSize) {
    const auto all = benches();
    const auto bench = std::find_if(all.begin(), all.end(), [](const Bench& b) { return b.name == "fem"; });
    ASSERT_NE(bench, all.end());
    for (const unsigned threads : {1u, 2u}) {
        BenchOptions options;
        options.quick = true;
        options.threads = threads;
        const auto table = bench->run(options);
        ASSERT_TRUE(table.ok());
        const auto scaling =
            std::count_if(table->rows.begin(), table->rows.end(), [](const BenchRow& row) { return row["name"] == "scaling"; });
        EXPECT_EQ(scaling, 3 * 2 * static_cast<long>(threads)); // sizes, laws, thread counts
        ASSERT_EQ(table->sketches.size(), 1u);
        const std::string page = bench_page(*bench, *table);
        EXPECT_TRUE(page.find("<svg") != std::string::npos || page.find("No plots") != std::string::npos);
    }
}

TEST(BenchValidation, AReferenceThatIsMissingIsNamed) {
    const auto tips = compare_beam(reference_beams()[0], "no/such/folder", true);
    ASSERT_FALSE(tips.ok());
    EXPECT_NE(tips.error().to_string().find("sofa_cantilever_tet_linear"), std::string::npos);
}

} // namespace trocar::engine
