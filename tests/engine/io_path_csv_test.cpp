#include "engine/io/path_csv.hpp"
#include "io_bytes.hpp"

namespace trocar::engine::test {
namespace {

TEST(PathCsv, HeaderCommentsAndBlankLinesAreOptional) {
    const char* texts[] = {
        "t,insertion,rotation\n0,10,0\n1.5,20,-0.25\n",
        "0,10,0\n1.5,20,-0.25",
        "\xEF\xBB\xBF# a path\r\n\r\ntime [s], insertion_mm, rotation_rad\r\n 0 , 1e1 ,+0 # start\r\n1.5,20,-.25\r\n\r\n",
    };
    for (const char* text : texts) {
        const Result<std::vector<PathRow>> rows = parse_path_csv(text, "p.csv");
        ASSERT_TRUE(rows.ok()) << rows.error().to_string();
        ASSERT_EQ(rows->size(), 2u);
        EXPECT_EQ((*rows)[0].insertion, 10);
        EXPECT_EQ((*rows)[1].time, 1.5);
        EXPECT_EQ((*rows)[1].rotation, -0.25);
    }
}

TEST(PathCsv, AHeaderTellsTheOrderOfTheColumns) {
    const auto rows = parse_path_csv("rotation_rad,time_s,insertion_mm\n-0.25,1.5,20\n0.5,2,30\n", "p.csv");
    ASSERT_TRUE(rows.ok()) << rows.error().to_string();
    ASSERT_EQ(rows->size(), 2u);
    EXPECT_EQ((*rows)[0].time, 1.5);
    EXPECT_EQ((*rows)[0].insertion, 20);
    EXPECT_EQ((*rows)[0].rotation, -0.25);
    EXPECT_EQ((*rows)[1].column, (std::array<std::size_t, 3>{5, 7, 1}));
    const auto named = parse_path_csv("wire.rotation,wire.insertion,t\n1,2,3\n", "p.csv");
    ASSERT_TRUE(named.ok()) << named.error().to_string();
    EXPECT_EQ((*named)[0].time, 3);
    EXPECT_EQ((*named)[0].insertion, 2);
}

TEST(PathCsv, WhatIsWrongIsNamedWithLineAndColumn) {
    struct Case {
        const char* text;
        std::size_t line, column;
        const char* word;
    };
    const Case cases[] = {
        {"", 0, 0, "no row"},
        {"t,insertion,rotation\n# nothing\n", 0, 0, "no row"},
        {"0,1\n", 1, 1, "2 columns"},
        {"0,1,2,3\n", 1, 1, "4 columns"},
        {"0,1,0\n1, ten,0\n", 2, 4, "'ten'"},
        {"0,1,0\n1,nan,0\n", 2, 3, "finite"},
        {"0,1,0\n1,1,1e999\n", 2, 5, "finite"},
        {"0,1,0\n0,1,0\n", 2, 1, "must increase"},
        {"1,1,0\n0.5,1,0\n", 2, 1, "must increase"},
        {"0,1,\n", 1, 1, "rotation is missing"},
        {"t,insertion,insertion\n0,0,0\n", 1, 1, "'t'"},
        {"rotation,t,insertion\n0,0,0\n1,0,0\n", 3, 3, "must increase"},
        {"0,1,0\nt,insertion,rotation\n", 2, 1, "'t'"},
        {"0;1;0\n", 1, 1, "1 columns"},
    };
    for (const Case& c : cases) {
        const Result<std::vector<PathRow>> rows = parse_path_csv(c.text, "p.csv");
        ASSERT_FALSE(rows.ok()) << c.text;
        EXPECT_EQ(rows.error().file, "p.csv");
        EXPECT_EQ(rows.error().line, c.line) << rows.error().to_string();
        EXPECT_EQ(rows.error().column, c.column) << rows.error().to_string();
        EXPECT_NE(rows.error().message.find(c.word), std::string::npos) << rows.error().to_string();
    }
}

TEST(PathCsv, AHeaderOfNamesMovesSeveralInstruments) {
    const auto paths = parse_path_table("time_s, wire.insertion_mm, cath.eter.rotation [rad],cath.eter.insertion,wire.rotation\n"
                                        "0,1,2,3,4\n# on\n0.5,5,6,7,8\n",
                                        "p.csv");
    ASSERT_TRUE(paths.ok()) << paths.error().to_string();
    ASSERT_EQ(paths->size(), 2u);
    EXPECT_EQ((*paths)[0].instrument, "wire");
    EXPECT_EQ((*paths)[1].instrument, "cath.eter");
    ASSERT_EQ((*paths)[0].rows.size(), 2u);
    ASSERT_EQ((*paths)[1].rows.size(), 2u);
    EXPECT_EQ((*paths)[0].rows[1].time, 0.5);
    EXPECT_EQ((*paths)[0].rows[1].insertion, 5);
    EXPECT_EQ((*paths)[0].rows[1].rotation, 8);
    EXPECT_EQ((*paths)[1].rows[0].insertion, 3);
    EXPECT_EQ((*paths)[1].rows[0].rotation, 2);
    EXPECT_EQ((*paths)[1].rows[1].line, 4u);
    EXPECT_EQ((*paths)[1].rows[1].column, (std::array<std::size_t, 3>{1, 9, 7}));
    const auto one = parse_path_csv("t,a.insertion,a.rotation\n0,1,2\n", "p.csv");
    ASSERT_TRUE(one.ok());
    EXPECT_EQ((*one)[0].rotation, 2);
}

TEST(PathCsv, WhatIsWrongWithNamedColumnsIsNamedWithLineAndColumn) {
    struct Case {
        const char* text;
        std::size_t line, column;
        const char* word;
    };
    const Case cases[] = {
        {"t,a.insertion,a.rotation,b.insertion\n0,1,2,3\n", 1, 26, "b.insertion and b.rotation belong together"},
        {"t,a.insertion,a.rotation,a.insertion\n0,1,2,3\n", 1, 26, "a.insertion stands twice"},
        {"t,a.insertion,a.rotation,b.speed\n0,1,2,3\n", 1, 26, "'b.speed'"},
        {"t,a.insertion,a.rotation,\n0,1,2,3\n", 1, 1, "NAME.insertion"},
        {"a.insertion,a.rotation\n1,2\n", 1, 1, "has no column t"},
        {"t,a.insertion,time,a.rotation\n0,1,2,3\n", 1, 15, "t stands twice"},
        {"t,a.insertion,a.rotation,b.insertion,b.rotation\n0,1,2,3\n", 2, 1, "4 columns; the header has 5"},
        {"t,a.insertion,a.rotation\n0,1,2\n1,1,two\n", 3, 5, "a.rotation is 'two'"},
        {"t,a.insertion,a.rotation\n0,,2\n", 2, 1, "a.insertion is missing"},
        {"t,a.insertion,a.rotation\n", 0, 0, "no row"},
        {"0,1,2\nt,a.insertion,a.rotation\n", 2, 1, "'t'"},
    };
    for (const Case& c : cases) {
        const auto paths = parse_path_table(c.text, "p.csv");
        ASSERT_FALSE(paths.ok()) << c.text;
        EXPECT_EQ(paths.error().file, "p.csv");
        EXPECT_EQ(paths.error().line, c.line) << paths.error().to_string();
        EXPECT_EQ(paths.error().column, c.column) << paths.error().to_string();
        EXPECT_NE(paths.error().message.find(c.word), std::string::npos) << paths.error().to_string();
    }
    const auto two = parse_path_csv("t,a.insertion,a.rotation,b.insertion,b.rotation\n0,1,2,3,4\n", "p.csv");
    ASSERT_FALSE(two.ok());
    EXPECT_NE(two.error().message.find("2 instruments"), std::string::npos);
}

using PathFiles = FolderTest;

TEST_F(PathFiles, WrittenRowsComeBackToTheLastBit) {
    const std::vector<PathRow> rows = {{0, 0.1, -1.0 / 3}, {0.1 + 0.2, 1e-9, 3.141592653589793}};
    ASSERT_TRUE(write_path_csv(folder_ / "path.csv", rows).ok());
    const Result<std::vector<PathRow>> back = read_path_csv(folder_ / "path.csv");
    ASSERT_TRUE(back.ok()) << back.error().to_string();
    ASSERT_EQ(back->size(), 2u);
    EXPECT_EQ((*back)[1].time, rows[1].time);
    EXPECT_EQ((*back)[0].rotation, rows[0].rotation);
}

TEST_F(PathFiles, AMissingFileIsNamed) {
    const Result<std::vector<PathRow>> rows = read_path_csv(folder_ / "none.csv");
    ASSERT_FALSE(rows.ok());
    EXPECT_EQ(rows.error().code, ErrorCode::FileNotFound);
}

} // namespace
} // namespace trocar::engine::test
