// `bench seed001`: every setup that is called exact finds what the reference finds, no setup invents anything, and the switches that are
// called heuristic are bounded by what they are allowed to lose.
#include "program.hpp"

namespace trocar::cli_test {
namespace {

class BenchSeed001 : public Program {};

TEST_F(BenchSeed001, ExactSetupsLoseNothingAndNoSetupInventsAnything) {
    const fs::path file = folder / "seed001.json";
    ASSERT_TRUE(ended_with(call({"bench", "seed001", "--quick", "--json", file.string()}), 0));
    const Json table = Json::parse(text_of(file), nullptr, false);
    ASSERT_TRUE(table.contains("rows"));
    int exact = 0, with_paper = 0, losing = 0, by_vertices = 0;
    for (const Json& row : table["rows"]) {
        EXPECT_EQ(row["invented"], 0) << row;
        EXPECT_GT(row["box_tests"], 0) << row;
        if (row["label"] == "exact") {
            ++exact;
            EXPECT_EQ(row["lost"], 0) << row;
        }
        if (row.contains("lost_of_nameable_percent")) { // a method of vertices: what it has no name for is not what it loses
            ++by_vertices;
            EXPECT_LE(row["nameable_percent"].get<double>() + row["lost_percent"].get<double>(), 100.0 + 1e-6 + row["lost_of_nameable_percent"].get<double>());
            EXPECT_LT(row["lost_of_nameable_percent"], 5.0) << row;
        }
        with_paper += row["paper_total_s"].is_number();
        losing += row["lost"] > 0;
        // oriented inflation, k, arity, lazy refit and the list are exact: they lose no more than the set that they are a change of
        const std::string setup = row["setup"];
        if (row["scene"] == "walking" && !setup.starts_with("vertices") && !setup.starts_with("oriented") &&
            !setup.starts_with("velocity")) {
            EXPECT_LT(row["lost_percent"], 1.0) << row;
        }
    }
    EXPECT_GE(exact, 4);
    EXPECT_EQ(by_vertices, 2);
    EXPECT_EQ(with_paper, 4);
    EXPECT_GT(losing, 0) << "no heuristic loses anything: nothing is measured";
    bool says = false;
    for (const Json& note : table["notes"]) says = says || note.get<std::string>().starts_with("3 steps");
    EXPECT_TRUE(says) << table["notes"];
    EXPECT_GT(table["rows"][0]["near"], 1000) << "trousers that are near nothing";
}

} // namespace
} // namespace trocar::cli_test
