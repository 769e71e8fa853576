// Every include of the product against the architecture of layers.hpp: folders include folders below them, and neither folders nor
// files include one another in a circle.
#include "layers.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

using namespace trocar::layers;

namespace {

struct SourceFile {
    std::string path, stripped;
};

const std::vector<SourceFile>& sources() {
    static const std::vector<SourceFile> files = [] {
        namespace fs = std::filesystem;
        const fs::path root = TROCAR_SOURCE_DIR;
        std::vector<SourceFile> found;
        for (const std::string_view module : kModules)
            for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / module)) {
                const std::string extension = entry.path().extension().string();
                if (!entry.is_regular_file() || (extension != ".hpp" && extension != ".cpp" && extension != ".h")) continue;
                std::ostringstream text;
                text << std::ifstream(entry.path()).rdbuf();
                found.push_back({fs::relative(entry.path(), root).generic_string(), strip_comments_and_strings(text.str())});
            }
        std::sort(found.begin(), found.end(), [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
        return found;
    }();
    return files;
}

/// name   of a path, what it belongs to: its folder or its stem
template <class Name>
Graph make_graph(Name&& name) {
    Graph graph;
    for (const SourceFile& file : sources()) {
        std::set<std::string>& targets = graph[name(file.path)];
        for (const std::string& included : includes_of(file.stripped))
            if (name(included) != name(file.path)) targets.insert(name(included));
    }
    return graph;
}

} // namespace

TEST(Architecture, EveryFolderIsListedAndIncludesOnlyFoldersBelowIt) {
    std::size_t includes = 0;
    for (const SourceFile& file : sources()) {
        EXPECT_NE(find_folder(folder_of(file.path)), nullptr) << file.path << " lies in a folder that layers.hpp does not list";
        for (const std::string& included : includes_of(file.stripped)) {
            const auto complaint = complaint_about_include(file.path, included);
            EXPECT_FALSE(complaint) << *complaint;
            ++includes;
        }
    }
    EXPECT_GT(sources().size(), 500u) << "the sources were not found";
    EXPECT_GT(includes, 1000u) << "the includes were not read";
}

TEST(Architecture, NoFoldersIncludeOneAnotherInACircle) {
    const Graph folders = make_graph(folder_of);
    for (const std::string& complaint : complaints_about_cycles(folders, {})) ADD_FAILURE() << "folders " << complaint;
    for (const auto& [folder, targets] : folders) {
        std::cout << folder << " ->";
        for (const std::string& target : targets) std::cout << ' ' << target;
        std::cout << '\n';
    }
}

TEST(Architecture, NoFilesIncludeOneAnotherInACircle) {
    const std::vector<std::string> known(kKnownCycle.begin(), kKnownCycle.end());
    for (const std::string& complaint : complaints_about_cycles(make_graph(stem_of), known)) ADD_FAILURE() << "files " << complaint;
}

TEST(Architecture, OnlyEngineTimeReadsAClockAndBaseDoesNoInputOrOutput) {
    for (const SourceFile& file : sources()) {
        const auto complaint = complaint_about_text(file.path, file.stripped);
        EXPECT_FALSE(complaint) << *complaint;
    }
}

TEST(ArchitectureRules, KnowForbiddenIncludesFromAllowedOnes) {
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
    forbidden("spheretree/build/build.cpp", "engine/io/obj.hpp");
    forbidden("fem/tissue/tissue.cpp", "fem/rod/rod.hpp");
    forbidden("fem/rod/rod.cpp", "fem/embedding/links.hpp");
    forbidden("spheretree/build/build.cpp", "spheretree/lumen/lumen_tree.hpp");
    forbidden("spheretree/sphere_tree.cpp", "spheretree/build/piece.hpp");
    forbidden("collision/ccd/sweep.cpp", "collision/bvh/dop_tree.hpp");
    forbidden("collision/search/contact_search.cpp", "collision/proximity/face_proximity.hpp");
    forbidden("engine/step/step.cpp", "engine/report/observer.hpp");
    forbidden("engine/step/step.cpp", "engine/render/renderer.hpp");
    forbidden("engine/step/step.cpp", "engine/cli/commands.hpp");
    forbidden("engine/render/renderer.cpp", "engine/report/observer.hpp");
    forbidden("engine/experiments/verify.cpp", "bench/bench.hpp");
    forbidden("engine/viewer/server.cpp", "bench/bench.hpp");
    forbidden("engine/cli/bench_command.cpp", "bench/bench.hpp");
    forbidden("bench/bench.cpp", "engine/cli/commands.hpp");
    forbidden("engine/io/obj.cpp", "engine/time/clock.hpp");
    forbidden("engine/io/obj.cpp", "engine/scene/scene.hpp");
    forbidden("engine/io/obj.cpp", "fem/rod/rod.hpp");
    forbidden("engine/attic/a.cpp", "engine/io/obj.hpp");
    forbidden("engine/step/step.cpp", "engine/attic/a.hpp");
    forbidden("shaders/a.cpp", "base/box.hpp");
    forbidden("fem/rod/coaxial.cpp", "rod.hpp");
    forbidden("fem/rod/coaxial.cpp", "../rod/rod.hpp");
    allowed("base/box.cpp", "base/vec.hpp");
    allowed("fem/embedding/links.cpp", "base/topology.hpp");
    allowed("fem/rod/rod.cpp", "fem/tissue/material.hpp");
    allowed("collision/proximity/face_proximity.cpp", "collision/ccd/sweep.hpp");
    allowed("spheretree/traverse/descent.cpp", "spheretree/lumen/lumen_tree.hpp");
    allowed("engine/step/step.cpp", "collision/bvh/box_tree.hpp");
    allowed("engine/step/step.cpp", "engine/prepare/model.hpp");
    allowed("engine/report/photographer.cpp", "engine/render/renderer.hpp");
    allowed("engine/io/obj.cpp", "base/mesh.hpp");
    allowed("bench/bench.cpp", "engine/report/html.hpp");
    allowed("bench/program/main.cpp", "engine/cli/commands.hpp");
}

TEST(ArchitectureRules, FindCyclesOfAnyLength) {
    EXPECT_TRUE(find_cycles({{"a", {"b", "c"}}, {"b", {"c"}}, {"c", {}}}).empty()) << "two ways to one place are no cycle";
    EXPECT_EQ(find_cycles({{"a", {"b"}}, {"b", {"a", "c"}}}), (std::vector<std::vector<std::string>>{{"a", "b"}}));
    EXPECT_EQ(find_cycles({{"x", {"y"}}, {"y", {"z"}}, {"z", {"w"}}, {"w", {"x", "a"}}, {"a", {"b"}}, {"b", {"a"}}, {"c", {"a"}}}),
              (std::vector<std::vector<std::string>>{{"a", "b"}, {"w", "x", "y", "z"}}));
}

TEST(ArchitectureRules, ComplainOfUnknownCyclesAndOfKnownOnesThatAreGone) {
    const Graph graph{{"a", {"b"}}, {"b", {"a"}}, {"c", {"a"}}};
    EXPECT_EQ(complaints_about_cycles(graph, {}).size(), 1u);
    EXPECT_EQ(complaints_about_cycles(graph, {"a"}).size(), 1u) << "the cycle has grown";
    EXPECT_TRUE(complaints_about_cycles(graph, {"a", "b"}).empty());
    EXPECT_EQ(complaints_about_cycles(graph, {"a", "b", "c"}).size(), 1u) << "c is in none";
}

TEST(ArchitectureRules, TakeAHeaderAndItsSourceForOne) {
    EXPECT_EQ(stem_of("fem/rod/rod.cpp"), stem_of("fem/rod/rod.hpp"));
    EXPECT_EQ(folder_of("spheretree/sphere_tree.hpp"), "spheretree");
    EXPECT_EQ(folder_of("rod.hpp"), "");
}

TEST(ArchitectureRules, SeeClocksInCodeButNotInCommentsOrStrings) {
    const auto complains = [](const std::string& file, const std::string& text) {
        return complaint_about_text(file, strip_comments_and_strings(text)).has_value();
    };
    EXPECT_TRUE(complains("engine/step/step.cpp", "auto t = std::chrono::steady_clock::now();"));
    EXPECT_TRUE(complains("bench/bench.cpp", "auto t = std::chrono::steady_clock::now();"));
    EXPECT_TRUE(complains("fem/rod/rod.cpp", "int n = 1'000'000; clock_gettime(CLOCK_MONOTONIC, &t);"));
    EXPECT_TRUE(complains("base/repair.cpp", "#include <fstream>\n"));
    EXPECT_TRUE(complains("collision/x.cpp", "std::unordered_map<int, int> m;"));
    EXPECT_FALSE(complains("engine/time/clock.cpp", "auto t = std::chrono::steady_clock::now();"));
    EXPECT_FALSE(complains("fem/rod/rod.cpp", "// a steady_clock would not do\n/* nor\nclock_gettime */ int x;"));
    EXPECT_FALSE(complains("fem/rod/rod.cpp", "const char* s = \"steady_clock \\\" clock_gettime\";"));
    EXPECT_EQ(includes_of(strip_comments_and_strings("// #include \"fem/a.hpp\"\n#include \"base/b.hpp\"\n#include <vector>\n")),
              (std::vector<std::string>{"base/b.hpp"}));
}
