// Broken scenes and broken meshes: a clear refusal or a sound load, never a crash or a hang.
#include "program.hpp"
#include "tests/made/hostile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <sys/resource.h>

namespace trocar::cli_test {
namespace {

class BrokenScene : public Program {};
class NastyMesh : public Program {};

constexpr double kTimeLimit = kPatience; // for one file; the usual is well below a second

TEST_F(BrokenScene, IsRefusedWithFileLineAndKey) {
    struct Spoiled {
        const char *piece, *other, *expected;
    };
    const Spoiled all[] = {
        {"\"step\": 0.01", "\"step\": \"often\"", "time.step"},
        {"\"step\": 0.01", "\"step\": -0.01", "time.step"},
        {"\"step\": 0.01", "\"stepp\": 0.01", "step"},
        {"\"units\": {\"length\": \"mm\", \"pressure\": \"MPa\"},", "", "units"},
        {"\"length\": \"mm\"", "\"length\": \"parsec\"", "units.length"},
        {"\"kind\": \"static\"", "\"kind\": \"liquid\"", "bodies.tube.kind"},
        {"\"hollow\": true", "\"hollow\": 3", "bodies.tube.hollow"},
        {"\"shape\": \"tube\"", "\"shape\": \"klein bottle\"", "bodies.tube.surface"},
        {"{\"shape\": \"tube\", \"axis\": [[0, 0, 0, 4], [0, 0, 120, 4]], \"sides\": 16}", "\"none.obj\"", "none.obj"},
        {"{\"shape\": \"tube\", \"axis\": [[0, 0, 0, 4], [0, 0, 120, 4]], \"sides\": 16}",
         "{\"recipe\": \"none.json\", \"part\": \"lumen\"}", "none.json"},
        {"[0, 0, 0, 4]", "[0, 0, 0, -4]", "bodies.tube.surface"},
        {"[0, 0, 0, 4]", "[0, 0, 4]", "bodies.tube.surface"},
        {"[0, 0, 0, 4]", "[0, 0, 120, 4]", "bodies.tube"},
        {"\"radius\": 0.5", "\"radius\": 500", "instruments.wire.radius"},
        {"\"radius\": 0.5", "\"radius\": 6", "instruments.wire"},
        {"\"young_modulus\": 60", "\"young_modulus\": 6e20", "instruments.wire.young_modulus"},
        {"\"young_modulus\": 60", "\"young_modulus\": 60, \"density\": -1200", "instruments.wire.density"},
        {"\"lumen\": \"tube\"", "\"lumen\": \"tub\"", "tube"},
        {"[0, 0, 10]", "[0, 0, 1000]", "instruments.wire.entry"},
        {"\"direction\": [0, 0, 1]", "\"direction\": [0, 0, 0]", "direction"},
        {"[0.2, 26, 0.4]", "[0.2, 260, 0.4]", "instruments.wire.path"},
        {"[0.2, 26, 0.4]", "[-0.2, 26, 0.4]", "instruments.wire.path"},
        {"\"exact_contact\"]", "\"levitation\"]", "levitation"},
        {"\"budget\": \"exact\"", "\"budget\": \"-1ms\"", "budget"},
        {"\"budget\": \"exact\"", "\"budget\": \"exact\", \"budget\": \"1ms\"", "budget"},
        {"\"step\": 0.01,", "\"step\": 0.01,,", "spoiled.json:"},
        {"\"step\": 0.01", "\"step\": NaN", "spoiled.json:"},
        {"\"step\": 0.01", "\"step\": 1e999", "spoiled.json"},
    };
    for (const Spoiled& each : all) {
        const fs::path scene = write("spoiled.json", with(kTube, each.piece, each.other));
        for (const char* command : {"run", "explain"}) {
            const Ended ended = std::string(command) == "run" ? run(scene) : call({"explain", scene});
            EXPECT_TRUE(refuses(ended, each.expected)) << command << " with " << each.other;
            EXPECT_TRUE(ended.says("spoiled.json")) << command << " with " << each.other << "\n" << ended;
            EXPECT_FALSE(fs::exists(out())) << each.other;
        }
    }
}

TEST_F(BrokenScene, OfAnyBytesIsRefused) {
    const std::string deep(100'000, '[');
    std::string zeros(5000, '\0');
    for (const std::string& text :
         {std::string(), std::string("{}"), std::string("[]"), std::string("null"), std::string("{\"units\""), deep, zeros,
          std::string("\xff\xfe{\0}\0", 6), std::string("/* no end"), kTube.substr(0, kTube.size() / 2), kTube + kTube})
        EXPECT_TRUE(refuses(run(write("bytes.json", text)), "bytes.json")) << text.substr(0, 60);
}

TEST_F(BrokenScene, CutAtAnyPlaceIsRefused) {
    for (std::size_t size = 1; size + 1 < kTube.size(); size += 97)
        EXPECT_TRUE(refuses(run(write("cut.json", kTube.substr(0, size))), "cut.json")) << "after " << size << " bytes";
}

/// Largest memory that sanitizers leave a small program at: shadows and quarantines.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kSmallMemory = 1000.0; // MB
#else
constexpr double kSmallMemory = 150.0; // MB
#endif

TEST_F(BrokenScene, OfTooLargeASizeIsRefusedInLittleMemory) {
    std::string far = "[0, 0, 0, 0.01]"; // a few hundred kilobytes that describe 40 million rings, a gigabyte of them
    for (int i = 1; i < 20000; ++i) far += i % 2 == 0 ? ", [0, 0, 0, 0.01]" : ", [90000, 0, 0, 0.01]";
    std::string boxes;
    for (const char* name : {"a", "b", "c", "d"}) // 12 million triangles
        boxes += "\"" + std::string(name) + R"(": {"kind": "static", "surface": {"shape": "box", "extent": [10, 10, 10], "cells": 500}}, )";
    const struct {
        std::string scene, expected;
    } all[] = {{with(kTube, "[0, 0, 0, 4], [0, 0, 120, 4]", far), "bodies.tube.surface.axis["},
               {with(kTube, "\"tube\": {\"kind\"", boxes + "\"tube\": {\"kind\""), "bodies.d.surface: found a box of 500 cells"}};
    for (const auto& each : all)
        for (const char* command : {"run", "explain"}) {
            const pid_t child = start({command, write("large.json", each.scene)});
            ASSERT_GT(child, 0);
            int status = 0;
            struct rusage usage {};
            ASSERT_EQ(wait4(child, &status, 0, &usage), child);
            const std::string said = text_of(folder / "stderr");
            EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 2) << command << " " << status << "\n" << said.substr(0, 500);
            EXPECT_NE(said.find("large.json:"), std::string::npos) << said.substr(0, 500);
            EXPECT_NE(said.find(each.expected), std::string::npos) << said.substr(0, 500);
            EXPECT_NE(said.find("expected at most 10000000 in the scene"), std::string::npos) << said.substr(0, 500);
            const double memory = static_cast<double>(usage.ru_maxrss) / 1024.0; // MB
            std::printf("%s, %s: %.0f MB\n", command, each.expected.c_str(), memory);
            EXPECT_LT(memory, kSmallMemory) << command << " " << each.expected;
        }
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) // their shadows alone are more than any limit
/// A sound file of 25 MB in an address space that holds little more than the program: memory ends while it is read.
TEST_F(BrokenScene, ThatNeedsMoreMemoryThanThereIsIsExit2) {
    constexpr std::uint32_t kTriangles = 500'000;
    std::string stl(84 + 50 * std::size_t{kTriangles}, '\0');
    std::memcpy(stl.data() + 80, &kTriangles, sizeof kTriangles);
    for (std::uint32_t t = 0; t < kTriangles; ++t) {
        const auto x = static_cast<float>(t);
        const float corners[] = {x, 0, 0, x + 1, 0, 0, x, 1, 0};
        std::memcpy(stl.data() + 84 + 50 * std::size_t{t} + 12, corners, sizeof corners);
    }
    const std::string command = "ulimit -v 100000; exec " + std::string(TROCAR_PROGRAM) + " prepare " + write("large.stl", stl).string() +
                                " > " + (folder / "said").string() + " 2>&1";
    const int status = std::system(("bash -c \"" + command + "\"").c_str());
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 2) << status << "\n" << text_of(folder / "said");
    EXPECT_NE(text_of(folder / "said").find("error: out of memory"), std::string::npos) << text_of(folder / "said");
}
#endif

/// Every file of the nasty collection, sorted.
std::vector<fs::path> nasty_files(const fs::path& data) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(data / "nasty"))
        if (entry.is_regular_file() && entry.path().extension() != ".json" && entry.path().extension() != ".md")
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

std::string surface_scene(const fs::path& mesh, const std::string& body, const std::string& effects) {
    return R"({"units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 0.03},
        "bodies": {"thing": {)" +
           body + R"(, "surface": {"file": ")" + mesh.string() + R"("}}}, "effects": [)" + effects + "]}";
}

/// Exit 0 or exit 2 with a message that names the file or the key.
void expect_sound_or_refused(const Ended& ended, const fs::path& mesh, const std::string& use) {
    SCOPED_TRACE(mesh.filename().string() + " as " + use);
    EXPECT_FALSE(ended.timed_out);
    EXPECT_EQ(ended.signal, 0) << ended;
    EXPECT_TRUE(ended.exit_code == 0 || ended.exit_code == 2) << ended;
    if (ended.exit_code == 2) {
        EXPECT_TRUE(ended.says(mesh.filename().string()) || ended.says("bodies.thing")) << ended;
    }
}

struct Use {
    const char *name, *body, *effects;
};
constexpr Use kUses[] = {
    {"static", R"("kind": "static")", R"("coarse_contact")"},
    {"hollow", R"("kind": "static", "hollow": true)", R"("coarse_contact")"},
    {"deformable", R"("kind": "deformable", "material": {"young_modulus": 5}, "coarse": {"surface_triangles": 60})",
     R"("elasticity", "damping")"},
};

/// 3,000 closed tetrahedra in a cube of 15 x 15 x 15 places: as many components.
std::string many_tetrahedra() {
    std::ostringstream out;
    for (int k = 0; k < 3000; ++k) {
        const int x = 10 * (k % 15), y = 10 * (k / 15 % 15), z = 10 * (k / 225), v = 4 * k;
        out << "v " << x << ' ' << y << ' ' << z << "\nv " << x + 5 << ' ' << y << ' ' << z << "\nv " << x << ' ' << y + 5 << ' ' << z
            << "\nv " << x << ' ' << y << ' ' << z + 5 << '\n';
        for (const auto& f : {std::array{1, 3, 2}, std::array{1, 2, 4}, std::array{2, 3, 4}, std::array{3, 1, 4}})
            out << "f " << v + f[0] << ' ' << v + f[1] << ' ' << v + f[2] << '\n';
    }
    return out.str();
}

/// Two tips over a ring of 200 vertices: every one of 400 triangles ends at a tip.
std::string bipyramid() {
    std::ostringstream out;
    out << "v 0 0 20\nv 0 0 -20\n";
    for (int k = 0; k < 200; ++k) out << "v " << 30 * std::cos(0.01 * M_PI * k) << ' ' << 30 * std::sin(0.01 * M_PI * k) << " 0\n";
    for (int k = 0; k < 200; ++k) {
        const int a = 3 + k, b = 3 + (k + 1) % 200;
        out << "f 1 " << a << ' ' << b << "\nf 2 " << b << ' ' << a << '\n';
    }
    return out.str();
}

/// Sound surfaces of an unusual make: a use that cannot accept them says so.
TEST_F(NastyMesh, ThousandsOfComponentsAndAVertexOf200TrianglesLoadOrAreRefused) {
    for (const fs::path& mesh : {write("thousands.obj", many_tetrahedra()), write("bipyramid.obj", bipyramid())})
        for (const Use& use : kUses) {
            const fs::path scene = write("nasty.json", surface_scene(mesh, use.body, use.effects));
            const Ended ended = call({"run", scene, "--out", out(), "--no-pictures", "--force", "-n", "2"}, kTimeLimit);
            expect_sound_or_refused(ended, mesh, use.name);
            std::cout << mesh.filename().string() << " as " << use.name << ": exit " << ended.exit_code << ' '
                      << ended.err.substr(0, ended.err.find('\n')) << '\n';
            if (std::string(use.name) == "static") EXPECT_TRUE(ended_with(ended, 0));
        }
}

/// Of the meshes of a folder as the test data have them.
class NastyFolder : public NastyMesh {
protected:
    void load_or_refuse(const fs::path& data, std::size_t least_files) {
        const std::vector<fs::path> files = nasty_files(data);
        ASSERT_GE(files.size(), least_files);
        int loaded = 0, refused = 0;
        for (const fs::path& mesh : files)
            for (const Use& use : kUses) {
                const fs::path scene = write("nasty.json", surface_scene(mesh, use.body, use.effects));
                const Ended ended = call({"run", scene, "--out", out(), "--no-pictures", "--force", "-n", "2"}, kTimeLimit);
                expect_sound_or_refused(ended, mesh, use.name);
                loaded += ended.exit_code == 0;
                refused += ended.exit_code == 2;
            }
        EXPECT_GT(loaded, 0);
        EXPECT_GT(refused, 0);
        std::cout << loaded << " loaded, " << refused << " refused\n";
    }
    void explain_or_refuse(const fs::path& data) {
        for (const fs::path& mesh : nasty_files(data)) {
            const fs::path scene = write("nasty.json", surface_scene(mesh, R"("kind": "static")", ""));
            expect_sound_or_refused(call({"explain", scene}, kTimeLimit), mesh, "explain");
        }
    }
    void expect_defects_named(const fs::path& data) {
        constexpr std::pair<const char*, const char*> kNamed[] = {{"cube_nan_vertex.obj", "cube_nan_vertex.obj"},
                                                                  {"cube_inf_vertex.obj", "cube_inf_vertex.obj"},
                                                                  {"cube_open_one_face.obj", "fill_holes"},
                                                                  {"cube_flipped_face.obj", "orient"},
                                                                  {"cube_duplicate_face.obj", "drop_duplicates"},
                                                                  {"degenerate_zero_area.obj", "drop_degenerate"},
                                                                  {"edge_three_faces.obj", "three or more triangles"},
                                                                  {"index_out_of_range.obj", "index_out_of_range.obj"},
                                                                  {"empty.obj", "empty.obj"},
                                                                  {"cube_tiny.obj", "unit"},
                                                                  {"mobius_strip.obj", "closed"}};
        for (const auto& [file, piece] : kNamed) {
            const fs::path mesh = data / "nasty/synthetic" / file;
            const fs::path scene =
                write("nasty.json", surface_scene(mesh, R"("kind": "deformable", "material": {"young_modulus": 5})", R"("elasticity")"));
            EXPECT_TRUE(refuses(run(scene), piece)) << file;
        }
    }
    /// Written by this program.
    fs::path made_data() {
        made::write_hostile_meshes(folder / "made");
        return folder / "made";
    }
};

#define NEED_TEST_DATA(data)                                                                                                               \
    const char* data = std::getenv("TROCAR_TEST_DATA");                                                                                    \
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set"

TEST_F(NastyFolder, WrittenHereLoadsOrIsRefusedInEveryUse) { load_or_refuse(made_data(), 30); }
TEST_F(NastyFolder, WrittenHereIsExplainedOrRefused) { explain_or_refuse(made_data()); }
TEST_F(NastyFolder, WrittenHereHasItsDefectsNamed) { expect_defects_named(made_data()); }

TEST_F(NastyFolder, OfTheTestDataLoadsOrIsRefusedInEveryUse) {
    NEED_TEST_DATA(data);
    load_or_refuse(data, 30);
}
TEST_F(NastyFolder, OfTheTestDataIsExplainedOrRefused) {
    NEED_TEST_DATA(data);
    explain_or_refuse(data);
}
TEST_F(NastyFolder, OfTheTestDataHasItsDefectsNamed) {
    NEED_TEST_DATA(data);
    expect_defects_named(data);
}

} // namespace
} // namespace trocar::cli_test
