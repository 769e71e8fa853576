// What the page of outputs says is what the program writes.
#include "observe_fixture.hpp"

#include "engine/experiments/cost_page.hpp"
#include "engine/experiments/plan_files.hpp"
#include "engine/report/run_outputs.hpp"
#include "engine/report/step_table.hpp"

#include <gmock/gmock.h>

#include <set>

namespace trocar::engine::test {

class Outputs : public Folder {};

namespace {

std::vector<OutputTable> all_tables() {
    std::vector<OutputTable> tables = run_output_tables();
    for (const OutputTable& table : cost_output_tables()) tables.push_back(table);
    for (const OutputTable& table : plan_output_tables()) tables.push_back(table);
    return tables;
}

std::set<std::string> names_of(const std::string& title) {
    std::set<std::string> names;
    for (const OutputTable& table : all_tables())
        if (table.title == title)
            for (const OutputKey& key : table.keys) names.emplace(key.name);
    EXPECT_FALSE(names.empty()) << title;
    return names;
}

void expect_all_described(const nlohmann::json& object, const std::string& title) {
    const std::set<std::string> known = names_of(title);
    for (const auto& [key, value] : object.items()) EXPECT_TRUE(known.contains(key)) << title << ": " << key;
}

} // namespace

TEST_F(Outputs, EveryColumnAndKeyIsNamedOnceWithASentenceAndAKnownUnit) {
    const std::set<std::string_view> units{"", "[-]", "s", "ms", "m", "N", "N m", "J", "rad"};
    for (const OutputTable& table : all_tables()) {
        std::set<std::string_view> seen;
        for (const OutputKey& key : table.keys) {
            EXPECT_TRUE(seen.insert(key.name).second) << table.title << " has " << key.name << " twice";
            EXPECT_TRUE(units.contains(key.unit)) << table.title << ": " << key.name << " is in " << key.unit;
            EXPECT_GE(key.meaning.size(), 8u) << table.title << ": " << key.name;
            EXPECT_EQ(key.meaning.back(), '.') << table.title << ": " << key.name;
        }
    }
}

TEST_F(Outputs, ANameThatEndsInAUnitHasThatUnit) {
    for (const OutputTable& table : all_tables())
        for (const OutputKey& key : table.keys)
            for (const auto& [ending, unit] : {std::pair("_ms", "ms"), std::pair("_s", "s"), std::pair("_m", "m"), std::pair("_n", "N"),
                                               std::pair("_nm", "N m"), std::pair("_j", "J"), std::pair("_rad", "rad")})
                if (key.name.ends_with(ending)) EXPECT_EQ(key.unit, unit) << table.title << ": " << key.name;
}

TEST_F(Outputs, OfARunAreTheOnesThatThePageDescribes) {
    ASSERT_TRUE(tube_run().into(out, 3).ok());
    const nlohmann::json json = summary();
    expect_all_described(json, "summary.json");
    for (const nlohmann::json& body : json["bodies"]) expect_all_described(body, "summary.json: bodies");
    for (const nlohmann::json& instrument : json["instruments"]) expect_all_described(instrument, "summary.json: instruments");
    const std::vector<std::string> lines = lines_of("steps.csv");
    ASSERT_EQ(lines.size(), 4u);
    EXPECT_EQ(lines[0], step_table_header());
    for (const std::string& line : lines)
        EXPECT_EQ(static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1, step_table_columns().size());
}

TEST_F(Outputs, ThatScriptsReliedOnBeforeKeepTheirOrder) {
    EXPECT_THAT(step_table_header(), ::testing::StartsWith("step,time_s,substeps,fem_ms,steer_ms,descend_ms,exact_ms,respond_ms,total_ms,budget_ms,"
                                                           "pairs_tested,pairs_open,leaf_contacts,level_reached,exact_ran,exact_contacts,unresolved,"
                                                           "min_volume_ratio,inverted_tets,kinetic_j,elastic_j,tip_x,tip_y,tip_z,insertion_m,rotation_rad,"));
    const auto csv = cost_csv(CostTable{});
    EXPECT_THAT(csv, ::testing::StartsWith("budget,step_ms_p50,step_ms_p99,budget_kept,pairs_open_mean,leaf_contacts_mean,level_reached_mean,"
                                           "missed_contacts,false_contacts,depth_error_rms_m,force_error_rel,surface_rms_m,surface_hausdorff_m"));
    EXPECT_THAT(csv, ::testing::Not(::testing::HasSubstr("variant"))) << "that column is there with variants alone";
}

} // namespace trocar::engine::test
