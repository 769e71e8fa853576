// Regression runs: lists, references, and the first difference in words.
#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/gzip.hpp"
#include "engine/experiments/regression_page.hpp"
#include "step_fixture.hpp"
#include "tests/temp_folder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace trocar::engine {
namespace {

class Regression : public trocar::FolderTest {
protected:
    Regression() {
        write("tube.json", "{}");
        write("other.json", "{}");
    }
    testing::AssertionResult refuses(const std::string& text, const std::string& piece) const {
        const auto list = read_regression_list(write("list.txt", text));
        if (list.ok()) return testing::AssertionFailure() << "took " << text;
        const std::string words = list.error().to_string();
        if (words.find(piece) == std::string::npos) return testing::AssertionFailure() << "\"" << piece << "\" is not in: " << words;
        return testing::AssertionSuccess();
    }
};

TEST_F(Regression, ListsHaveALinePerSceneAndComments) {
    const auto list = read_regression_list(write("list.txt", "# all\n\n  tube.json\t10  1e-6 # why\r\nother.json 20 0 work:500"));
    ASSERT_TRUE(list.ok()) << list.error().to_string();
    ASSERT_EQ(list->size(), 2u);
    EXPECT_EQ((*list)[0].steps, 10u);
    EXPECT_EQ((*list)[0].tolerance, 1e-6);
    EXPECT_EQ((*list)[0].line, 3u);
    EXPECT_EQ((*list)[0].budget.mode, BudgetMode::Work);
    EXPECT_EQ((*list)[1].budget.work_units, 500u);
    EXPECT_EQ((*list)[1].reference, folder / "references" / "other.json.gz");
}

TEST_F(Regression, ListsThatAreNoneAreRefusedByLine) {
    EXPECT_TRUE(refuses("", "no scene"));
    EXPECT_TRUE(refuses("# nothing\n", "no scene"));
    EXPECT_TRUE(refuses("tube.json 10 0\ntube.json", "list.txt:2"));
    EXPECT_TRUE(refuses("tube.json ten 0", "no number of steps"));
    EXPECT_TRUE(refuses("tube.json 0 0", "no number of steps"));
    EXPECT_TRUE(refuses("tube.json -3 0", "no number of steps"));
    EXPECT_TRUE(refuses("tube.json 10 -1", "no tolerance"));
    EXPECT_TRUE(refuses("tube.json 10 nan", "no tolerance"));
    EXPECT_TRUE(refuses("tube.json 10 0 8ms", "depends on the machine"));
    EXPECT_TRUE(refuses("tube.json 10 0 soon", "not understood"));
    EXPECT_TRUE(refuses("tube.json 10 0 exact more", "5 words"));
    EXPECT_TRUE(refuses("nowhere.json 10 0", "nowhere.json is not there"));
    EXPECT_TRUE(refuses("tube.json 10 0\n./tube.json 20 0", "line 1 has a scene called tube"));
    EXPECT_FALSE(read_regression_list(folder / "none.txt").ok());
}

Trace run_tube(int steps) {
    RegressionEntry entry;
    entry.name = "tube";
    entry.steps = static_cast<std::uint64_t>(steps);
    entry.budget = {BudgetMode::Work, 0.0, 100000};
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({.host_body = test::kOrgan}));
    return run_trace(prepared.model, entry);
}

TEST_F(Regression, ReferencesAreSmallAndReadBackToTheLastBit) {
    const Trace trace = run_tube(50);
    const std::filesystem::path file = folder / "references" / "tube.json.gz";
    ASSERT_TRUE(write_trace(file, trace).ok());
    EXPECT_LT(std::filesystem::file_size(file), 50'000u);
    const auto back = read_trace(file);
    ASSERT_TRUE(back.ok()) << back.error().to_string();
    EXPECT_EQ(trace_text(*back), trace_text(trace));
    EXPECT_EQ(first_difference(*back, trace, 0.0), "");
    EXPECT_EQ(first_difference(*back, run_tube(50), 0.0), "") << "work mode: the same bits";
}

TEST_F(Regression, TheFirstDifferenceIsNamedByStepPartNodeAndSize) {
    const Trace trace = run_tube(50);
    ASSERT_GT(trace.samples.size(), 12u);
    Trace other = trace;
    other.samples[10].parts[0].points[2].x() += 1e-5;
    other.samples[12].parts[0].points[2].x() += 1e-2;
    other.state_hash ^= 1;
    const std::string words = first_difference(trace, other, 0.0);
    EXPECT_NE(words.find(fmt::format("step {}, organ, node {}", trace.samples[10].step, trace.samples[10].parts[0].ids[2])),
              std::string::npos)
        << words;
    EXPECT_NE(words.find("1e-05 m"), std::string::npos) << words;
    EXPECT_NE(first_difference(trace, other, 1e-4).find(fmt::format("step {}", trace.samples[12].step)), std::string::npos);
    EXPECT_EQ(first_difference(trace, other, 0.05), "");
}

TEST_F(Regression, EnergyContactsHashAndStopsCountAsWell) {
    const Trace trace = run_tube(30);
    Trace other = trace;
    other.state_hash ^= 1;
    EXPECT_NE(first_difference(trace, other, 0.0).find("state"), std::string::npos);
    EXPECT_EQ(first_difference(trace, other, 1e-9), "") << "another compiler may round otherwise";
    other.samples[5].elastic_j *= 2.0;
    EXPECT_NE(first_difference(trace, other, 1e-9).find("elastic"), std::string::npos);
    other = trace;
    other.samples[5].contacts += 100;
    EXPECT_NE(first_difference(trace, other, 1e-9).find("contacts"), std::string::npos);
    other = trace;
    other.failure = "organ: node 3 is not finite";
    EXPECT_NE(first_difference(trace, other, 1e-9).find("organ: node 3"), std::string::npos);
    other = trace;
    other.samples[0].parts[0].points[0].x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(first_difference(trace, other, 0.05), "");
}

TEST_F(Regression, DamagedReferencesAreRefused) {
    const std::filesystem::path file = folder / "tube.json.gz";
    ASSERT_TRUE(write_trace(file, run_tube(5)).ok());
    const std::string packed = [&] {
        std::string bytes;
        if (FILE* in = std::fopen(file.c_str(), "rb"); in != nullptr) {
            for (int c = std::fgetc(in); c != EOF; c = std::fgetc(in)) bytes.push_back(static_cast<char>(c));
            std::fclose(in);
        }
        return bytes;
    }();
    for (const std::string& damaged : {packed.substr(0, packed.size() / 2), std::string("hello"), std::string(), std::string("{}"),
                                       std::string(R"({"format": "trocar-reference", "version": 2})"),
                                       std::string(R"({"format": "trocar-reference", "version": 1, "steps": "many"})")}) {
        ASSERT_TRUE(write_file_atomically(file, damaged).ok());
        const auto back = read_trace(file);
        ASSERT_FALSE(back.ok()) << damaged;
        EXPECT_NE(back.error().to_string().find("tube.json.gz"), std::string::npos);
    }
}

TEST(Gzip, UnpacksToWhatWasPackedAndIsTheSameEveryTime) {
    for (const std::size_t size : {0u, 1u, 1000u, 300'000u}) {
        std::string text(size, 'a');
        for (std::size_t k = 0; k < size; k += 7) text[k] = static_cast<char>('a' + k % 23);
        const auto packed = gzip_bytes(text);
        ASSERT_TRUE(packed.ok());
        const auto back = inflate_bytes(*packed, 1 << 20);
        ASSERT_TRUE(back.ok()) << size;
        EXPECT_EQ(*back, text);
        EXPECT_EQ(*gzip_bytes(text), *packed);
    }
}

TEST_F(Regression, DriftNamesPartStepNodeAndSize) {
    const Trace reference = run_tube(40);
    Trace now = reference;
    for (const PartDrift& same : measure_drift(reference, now, 0.0)) EXPECT_TRUE(same.first_step == 0 && same.worst_m == 0.0) << same.part;
    const std::size_t part = now.samples[0].parts.size() - 1;
    now.samples[4].parts[part].points[2].x() += 2e-3;
    now.samples[6].parts[part].points[3].y() -= 5e-3;
    const std::vector<PartDrift> drifts = measure_drift(reference, now, 1e-3);
    const PartDrift& wire = drifts.back();
    EXPECT_EQ(wire.part, "wire");
    EXPECT_EQ(wire.first_step, reference.samples[4].step);
    EXPECT_EQ(wire.worst_step, reference.samples[6].step);
    EXPECT_EQ(wire.worst_node, reference.samples[6].parts[part].ids[3]);
    EXPECT_NEAR(wire.worst_m, 5e-3, 1e-12);
    EXPECT_EQ(wire.curve.size(), reference.samples.size());
    now.samples[7].parts[part].points[0].z() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(std::isinf(measure_drift(reference, now, 1e-3).back().worst_m));
    RegressionEntry entry;
    entry.name = "<tube>";
    entry.tolerance = 1e-3;
    const std::vector<RegressionOutcome> outcomes{{entry, reference, reference, {}}, {entry, reference, now, "step 8, wire"}};
    const std::string page = regression_page(outcomes);
    EXPECT_NE(page.find("1 of 2 scenes differ"), std::string::npos);
    EXPECT_EQ(page.find("<tube>"), std::string::npos) << "names are text";
    EXPECT_TRUE(page.find("<svg") != std::string::npos || page.find("No plots") != std::string::npos);
}

} // namespace
} // namespace trocar::engine
