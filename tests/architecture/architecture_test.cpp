// Keeps the house standing: engine -> {collision, spheretree, fem, assets} -> base, and no other arrow.
#include "house.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

using namespace trocar::house;

namespace {

struct SourceFile {
    std::string path, stripped;
};

std::vector<SourceFile> read_sources() {
    namespace fs = std::filesystem;
    const fs::path root = TROCAR_SOURCE_DIR;
    std::vector<SourceFile> files;
    for (const std::string_view room : kRooms) {
        if (!fs::exists(root / room)) continue;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / room)) {
            const std::string extension = entry.path().extension().string();
            if (!entry.is_regular_file() || (extension != ".hpp" && extension != ".cpp" && extension != ".h")) continue;
            std::ostringstream text;
            text << std::ifstream(entry.path()).rdbuf();
            files.push_back({fs::relative(entry.path(), root).generic_string(), strip_comments_and_strings(text.str())});
        }
    }
    std::sort(files.begin(), files.end(), [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
    return files;
}

} // namespace

TEST(House, EveryIncludeRunsDownwards) {
    const std::vector<SourceFile> files = read_sources();
    std::size_t arrows = 0;
    for (const SourceFile& file : files)
        for (const std::string& included : includes_of(file.stripped)) {
            const auto complaint = complaint_about_include(file.path, included);
            EXPECT_FALSE(complaint) << *complaint;
            arrows += !place_of(included).room.empty();
        }
    EXPECT_GT(files.size(), 20u) << "the sources were not found";
    EXPECT_GT(arrows, 50u) << "the includes were not read";
}

TEST(House, OnlyEngineTimeReadsAClockAndBaseDoesNoInputOrOutput) {
    for (const SourceFile& file : read_sources()) {
        const auto complaint = complaint_about_text(file.path, file.stripped);
        EXPECT_FALSE(complaint) << *complaint;
    }
}

TEST(HouseRules, KnowForbiddenArrowsFromAllowedOnes) {
    const auto forbidden = [](const char* file, const char* included) {
        EXPECT_TRUE(complaint_about_include(file, included)) << file << " -> " << included;
    };
    const auto allowed = [](const char* file, const char* included) {
        EXPECT_FALSE(complaint_about_include(file, included)) << *complaint_about_include(file, included);
    };
    forbidden("base/box.hpp", "fem/rod/rod.hpp");
    forbidden("fem/embedding/links.cpp", "collision/bvh/box_tree.hpp");
    forbidden("collision/bvh/box_tree.cpp", "spheretree/traverse/descent.hpp");
    forbidden("assets/anatomy/generate.cpp", "fem/rod/rod.hpp");
    forbidden("spheretree/build.cpp", "engine/io/obj.hpp");
    forbidden("engine/step/step.cpp", "engine/report/observer.hpp");
    forbidden("engine/step/step.cpp", "engine/render/renderer.hpp");
    forbidden("engine/step/step.cpp", "engine/cli/commands.hpp");
    forbidden("engine/io/obj.cpp", "engine/scene/scene.hpp");
    forbidden("engine/io/obj.cpp", "fem/rod/rod.hpp");
    forbidden("engine/attic/a.cpp", "engine/io/obj.hpp");
    allowed("base/box.cpp", "base/vec.hpp");
    allowed("base/box.cpp", "Eigen/Core");
    allowed("fem/embedding/links.cpp", "base/topology.hpp");
    allowed("engine/step/step.cpp", "collision/bvh/box_tree.hpp");
    allowed("engine/step/step.cpp", "engine/prepare/model.hpp");
    allowed("engine/observe/report.cpp", "engine/render/renderer.hpp");
    allowed("engine/io/obj.cpp", "base/mesh.hpp");
}

TEST(HouseRules, SeeClocksInCodeButNotInCommentsOrStrings) {
    const auto complains = [](const std::string& file, const std::string& text) {
        return complaint_about_text(file, strip_comments_and_strings(text)).has_value();
    };
    EXPECT_TRUE(complains("engine/step/step.cpp", "auto t = std::chrono::steady_clock::now();"));
    EXPECT_TRUE(complains("fem/rod/rod.cpp", "int n = 1'000'000; clock_gettime(CLOCK_MONOTONIC, &t);"));
    EXPECT_TRUE(complains("base/repair.cpp", "#include <fstream>\n"));
    EXPECT_TRUE(complains("collision/x.cpp", "std::unordered_map<int, int> m;"));
    EXPECT_FALSE(complains("engine/time/clock.cpp", "auto t = std::chrono::steady_clock::now();"));
    EXPECT_FALSE(complains("fem/rod/rod.cpp", "// a steady_clock would not do\n/* nor\nclock_gettime */ int x;"));
    EXPECT_FALSE(complains("fem/rod/rod.cpp", "const char* s = \"steady_clock \\\" clock_gettime\";"));
    EXPECT_EQ(includes_of(strip_comments_and_strings("// #include \"fem/a.hpp\"\n#include \"base/b.hpp\"\n#include <vector>\n")),
              (std::vector<std::string>{"base/b.hpp", "vector"}));
}
