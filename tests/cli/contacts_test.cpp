// `contacts` and `ccd`: right answers on meshes small enough to check by eye, clear refusals of everything else.
#include "program.hpp"

#include <zlib.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace trocar::cli_test {
namespace {

const std::string kHeader =
    "kind,body_a,feature_a0,feature_a1,body_b,feature_b0,feature_b1,feature_b2,time,bary_a,bary_b0,bary_b1,normal_x,normal_y,normal_z";

/// One triangle; its corners at the given height.
std::string triangle(double height) {
    const std::string z = std::to_string(height);
    return "v 0 0 " + z + "\nv 4 0 " + z + "\nv 0 4 " + z + "\nf 1 2 3\n";
}
/// A spike: one vertex at (1, 1, tip), the other two high above.
std::string spike(double tip) { return "v 1 1 " + std::to_string(tip) + "\nv 1 0.5 20\nv 1 1.5 20\nf 1 2 3\n"; }

class Contacts : public Program {
protected:
    fs::path csv() const { return folder / "contacts.csv"; }
    fs::path stats() const { return folder / "stats.json"; }
    Ended contacts(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), "contacts");
        for (const std::string& more : {std::string("--out"), csv().string(), std::string("--stats"), stats().string()})
            arguments.push_back(more);
        return call(arguments);
    }
    std::vector<std::vector<std::string>> rows() const {
        std::istringstream in(text_of(csv()));
        std::string line;
        std::getline(in, line);
        EXPECT_EQ(line.substr(0, kHeader.size()), kHeader);
        std::vector<std::vector<std::string>> out;
        while (std::getline(in, line)) {
            std::vector<std::string>& row = out.emplace_back(1);
            for (const char c : line) {
                if (c == ',')
                    row.emplace_back();
                else
                    row.back() += c;
            }
        }
        return out;
    }
    Json json() const { return Json::parse(text_of(stats()), nullptr, false); }

    /// A folder of frames: two triangles of two objects, the second falls through the first in its first step.
    fs::path write_frames() const {
        const fs::path at = folder / "frames";
        fs::create_directory(at);
        std::ofstream(at / "meta.txt") << "name two\nnV 6\nnT 2\nframes 3\n";
        const std::array<std::int32_t, 6> triangles{0, 1, 2, 3, 4, 5}, objects{0, 0, 0, 1, 1, 1};
        write_array(at / "tris.i32", triangles);
        write_array(at / "obj.i32", objects);
        std::array<double, 54> positions{0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, 3, 1, 0.5, 20, 1, 1.5, 20};
        for (std::size_t k = 18; k < 54; ++k) positions[k] = positions[k - 18];
        positions[18 + 11] = positions[36 + 11] = -1;
        write_array(at / "pos.f64", positions);
        return at;
    }
    template <class Values>
    static void write_array(const fs::path& file, const Values& values) {
        std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(values.data()), sizeof values);
    }
};

TEST_F(Contacts, OfAVertexThatFallsThroughATriangle) {
    const std::string a0 = write("a0.obj", spike(3)), a1 = write("a1.obj", spike(-1));
    const std::string b = write("b.obj", triangle(0));
    ASSERT_TRUE(ended_with(contacts({a0, a1, b, b}), 0));
    const auto found = rows();
    ASSERT_EQ(found.size(), 1u) << text_of(csv());
    const auto& row = found[0];
    EXPECT_EQ((std::vector<std::string>(row.begin(), row.begin() + 8)), (std::vector<std::string>{"VF", "0", "0", "", "1", "0", "1", "2"}));
    EXPECT_NEAR(std::stod(row[8]), 0.75, 1e-12);
    EXPECT_NEAR(std::stod(row[10]), 0.5, 1e-12);
    EXPECT_NEAR(std::stod(row[11]), 0.25, 1e-12);
    EXPECT_NEAR(std::stod(row[14]), 1.0, 1e-12);
    EXPECT_EQ(json()["hits_vf"], 1);
    EXPECT_EQ(json()["hits_ee"], 0);
    for (const char* key : {"candidates_vf", "candidates_ee", "unresolved", "build_ms", "refit_ms", "broad_ms", "cull_ms", "narrow_ms",
                            "total_ms", "method", "colours"})
        EXPECT_TRUE(json().contains(key)) << key;
}

TEST_F(Contacts, WithinADistanceComeEarlier) {
    const std::string a0 = write("a0.obj", spike(3)), a1 = write("a1.obj", spike(-1));
    const std::string b = write("b.obj", triangle(0));
    ASSERT_TRUE(ended_with(contacts({a0, a1, b, b, "--distance", "1"}), 0));
    const auto found = rows();
    ASSERT_GT(found.size(), 1u) << "the spike's edges come near as well";
    EXPECT_EQ(found.back()[0], "VF");
    EXPECT_NEAR(std::stod(found.back()[8]), 0.5, 1e-6);
}

TEST_F(Contacts, AreTheSameByEveryMethod) {
    std::string soup[2];
    std::uint32_t state = 7;
    const auto number = [&state] { return static_cast<double>((state = state * 1664525u + 1013904223u) >> 8) / 16777216.0; };
    for (int i = 0; i < 120; ++i) {
        const double x = 4 * number(), y = 4 * number(), z = 4 * number();
        std::ostringstream t0, t1;
        for (int k = 0; k < 3; ++k) {
            const double px = x + number(), py = y + number(), pz = z + number();
            t0 << "v " << px << ' ' << py << ' ' << pz << '\n';
            t1 << "v " << px + number() - 0.5 << ' ' << py + number() - 0.5 << ' ' << pz + number() - 0.5 << '\n';
        }
        const std::string face = "f -3 -2 -1\n";
        soup[0] += t0.str() + face;
        soup[1] += t1.str() + face;
    }
    const std::string a0 = write("a0.obj", soup[0]), a1 = write("a1.obj", soup[1]);
    ASSERT_TRUE(ended_with(contacts({a0, a1, "--method", "brute"}), 0));
    const auto truth = rows();
    EXPECT_GT(truth.size(), 100u);
    for (const std::string method : {"exact", "plain", "dop14-arity2-median", "dop18-paper-cluster1", "dop26-arity4-cluster32"})
        for (const std::string threads : {"1", "2"}) {
            ASSERT_TRUE(ended_with(contacts({a0, a1, "--method", method, "--threads", threads}), 0)) << method;
            EXPECT_TRUE(rows() == truth) << method; // printed, they fill screens
        }
    // set-based culling by every back end; without OpenGL by the CPU
    for (const std::string method : {"chromatic", "chromatic-cpu", "chromatic-gl", "chromatic-query", "chromatic-none"}) {
        ASSERT_TRUE(ended_with(contacts({a0, a1, "--method", method}), 0)) << method;
        EXPECT_TRUE(rows() == truth) << method;
    }
    // time runs backwards: the same pairs
    ASSERT_TRUE(ended_with(contacts({a1, a0}), 0));
    auto reversed = rows();
    ASSERT_EQ(reversed.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i)
        for (std::size_t k = 0; k < 8; ++k) EXPECT_EQ(reversed[i][k], truth[i][k]);
}

/// A wavy sheet and one that cuts it at a slant, as one file: much of both crosses nothing.
std::string crossing_sheets() {
    std::ostringstream out;
    constexpr int kSide = 56;
    for (const bool slanted : {false, true})
        for (int y = 0; y <= kSide; ++y)
            for (int x = 0; x <= kSide; ++x)
                out << "v " << x + (slanted ? 0.37 : 0.0) << ' ' << y << ' '
                    << (slanted ? 0.3 * (x - 20.0) : 0.8 * std::sin(0.2 * x) + 0.01 * y) << '\n';
    for (const int first : {1, 1 + (kSide + 1) * (kSide + 1)})
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) {
                const int a = first + y * (kSide + 1) + x;
                out << "f " << a << ' ' << a + 1 << ' ' << a + kSide + 1 << "\nf " << a + 1 << ' ' << a + kSide + 2 << ' ' << a + kSide + 1
                    << '\n';
            }
    return out.str();
}

TEST_F(Contacts, OfStaticMeshesAreTheSameByImageSpaceCullingOfPatchesAndOfTriangles) {
    const std::string sheets = write("sheets.obj", crossing_sheets());
    ASSERT_TRUE(ended_with(contacts({sheets, sheets, "--method", "image-space-flat"}), 0));
    const auto truth = rows();
    EXPECT_GT(truth.size(), 50u);
    const Json told = json();
    for (const Json& pass : told["passes"]) EXPECT_EQ(pass["patches"], 0) << pass;
    for (const std::string method : {"image-space", "image-space-gl"}) {
        const Ended ended = contacts({sheets, sheets, "--method", method});
        ASSERT_TRUE(ended_with(ended, 0)) << method;
        EXPECT_TRUE(rows() == truth) << method;
        EXPECT_TRUE(ended.says("patches of up to 16 triangles"));
        ASSERT_FALSE(json()["passes"].empty());
        EXPECT_GT(json()["passes"][0]["patches"], 0);
    }
    EXPECT_TRUE(ended_with(contacts({sheets, sheets, "--method", "image-space-paper"}), 0));
    EXPECT_LE(rows().size(), truth.size());
}

/// A driver that Mesa's switches limit: the CPU culls, the answer is the same, and the reason is said. Other drivers do not know the
/// switches, and cull.
TEST_F(Contacts, AreTheSameWhereOpenGlFailsAndTheReasonIsSaid) {
    const std::string sheets = write("sheets.obj", crossing_sheets());
    ASSERT_TRUE(ended_with(contacts({sheets, sheets, "--method", "image-space"}), 0));
    const auto truth = rows();
    struct Poor {
        const char *name, *value, *reason;
    };
    for (const Poor& poor :
         {Poor{"MESA_GL_VERSION_OVERRIDE", "3.3", "no OpenGL 4.5"},
          Poor{"MESA_EXTENSION_OVERRIDE", "-GL_ARB_shader_viewport_layer_array", "has no GL_ARB_shader_viewport_layer_array"}}) {
        setenv(poor.name, poor.value, 1);
        const Ended ended = contacts({sheets, sheets, "--method", "image-space-gl"});
        unsetenv(poor.name);
        ASSERT_TRUE(ended_with(ended, 0)) << poor.name;
        EXPECT_TRUE(rows() == truth) << poor.name;
        if (json()["culler"] == "CPU reference") {
            const bool nothing_here = ended.says("no OpenGL 4.5");
            EXPECT_TRUE(ended.says("culling on the CPU instead of OpenGL") && (ended.says(poor.reason) || nothing_here)) << ended;
        }
    }
}

TEST_F(Contacts, KeptFromStepToStepAreTheSame) {
    const std::string frames = write_frames();
    ASSERT_TRUE(ended_with(contacts({"--frames", frames}), 0));
    const std::string anew = text_of(csv());
    ASSERT_TRUE(ended_with(contacts({"--frames", frames, "--coherent"}), 0));
    EXPECT_EQ(text_of(csv()), anew);
    EXPECT_EQ(json()["method"], "exact-dop6-arity8-sah-cluster32-coherent");
    EXPECT_GE(json()["sessions"], 1);
    EXPECT_TRUE(refuses(contacts({"--frames", frames, "--coherent", "--method", "dop14"}), "dop6"));
    EXPECT_TRUE(refuses(contacts({"--frames", frames, "--coherent", "--method", "brute"}), "--coherent"));
    EXPECT_TRUE(refuses(contacts({"--frames", frames, "--coherent", "--threads", "2"}), "one thread"));
    EXPECT_TRUE(refuses(contacts({"a.obj", "b.obj", "--coherent"}), "--frames"));
}

TEST_F(Contacts, KeptFromStepToStepAreComparedWithThoseThatAreNot) {
    const std::string frames = write_frames();
    const fs::path stats = folder / "compared.json";
    const Ended outcome = call({"contacts", "--frames", frames, "--coherent", "--compare", "--stats", stats.string()});
    ASSERT_TRUE(ended_with(outcome, 0));
    EXPECT_NE(outcome.out.find("the same contacts, bit for bit"), std::string::npos) << outcome.out;
    const Json compared = Json::parse(text_of(stats), nullptr, false);
    EXPECT_EQ(compared["same_contacts"], true);
    EXPECT_EQ(compared["steps_with_contacts"], 1);
    ASSERT_EQ(compared["steps"].size(), 2u);
    double anew = 0.0, coherent = 0.0;
    for (const Json& step : compared["steps"]) {
        anew += step["anew_ms"].get<double>();
        coherent += step["coherent_ms"].get<double>();
        EXPECT_GT(step["anew_work"], 0.0);
    }
    EXPECT_NEAR(compared["share"].get<double>(), coherent / anew, 1e-12);
    EXPECT_TRUE(refuses(call({"contacts", "--frames", frames, "--compare"}), "--coherent"));
    EXPECT_TRUE(refuses(contacts({"--frames", frames, "--coherent", "--compare"}), "--compare")); // asks for a CSV as well
}

TEST_F(Contacts, OfASequenceAreWrittenStepByStep) {
    const fs::path dump = folder / "hits.bin";
    ASSERT_TRUE(ended_with(contacts({"--frames", write_frames(), "--dump", dump}), 0));
    ASSERT_EQ(rows().size(), 1u) << text_of(csv()); // afterwards it stays within the face, and no vertex or edge meets another
    EXPECT_EQ(json()["steps"].size(), 2u);
    const std::string bytes = text_of(dump);
    ASSERT_EQ(bytes.size(), 24u * rows().size());
    std::array<std::int32_t, 4> first{};
    double time = 0.0;
    std::memcpy(first.data(), bytes.data(), 16);
    std::memcpy(&time, bytes.data() + 16, 8);
    EXPECT_EQ(first, (std::array<std::int32_t, 4>{0, 0, 3, 0}));
    EXPECT_NEAR(time, 0.75, 1e-12);
}

TEST_F(Contacts, RefuseWhatIsNoStepOfOneMesh) {
    const std::string a = write("a.obj", triangle(0)), b = write("b.obj", spike(0)),
                      nan = write("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::string turned = write("turned.obj", "v 0 0 0\nv 4 0 0\nv 0 4 0\nf 1 3 2\n"),
                      more = write("more.obj", triangle(0) + "v 1 1 1\n");
    const std::string two = write("two.obj", triangle(0) + "f 1 2 3\n");
    EXPECT_TRUE(refuses(contacts({a}), "1 meshes"));
    EXPECT_TRUE(refuses(contacts({a, a, b}), "3 meshes"));
    EXPECT_TRUE(refuses(contacts({a, nan}), "nan.obj"));
    EXPECT_TRUE(refuses(contacts({a, turned}), "triangle 0"));
    EXPECT_TRUE(refuses(contacts({a, more}), "4 vertices"));
    EXPECT_TRUE(refuses(contacts({a, two}), "2 triangles"));
    EXPECT_TRUE(refuses(contacts({a, folder / "none.obj"}), "none.obj"));
    EXPECT_TRUE(refuses(contacts({a, a, "--distance", "-1"}), "--distance"));
    EXPECT_TRUE(refuses(contacts({a, a, "--distance", "nan"}), "--distance"));
    EXPECT_TRUE(refuses(contacts({a, a, "--method", "magic"}), "magic"));
    EXPECT_TRUE(refuses(contacts({a, a, "--method", "dop7"}), "dop7"));
    EXPECT_TRUE(refuses(contacts({a, a, "--dump", folder / "x.bin"}), "--dump"));
    EXPECT_FALSE(fs::exists(csv()));
}

TEST_F(Contacts, RefuseBrokenFrames) {
    const fs::path at = write_frames();
    const auto spoil = [&](const char* file, const std::string& bytes, const char* expected) {
        const std::string before = text_of(at / file);
        std::ofstream(at / file, std::ios::binary) << bytes;
        EXPECT_TRUE(refuses(contacts({"--frames", at}), expected)) << file;
        std::ofstream(at / file, std::ios::binary) << before;
    };
    spoil("pos.f64", text_of(at / "pos.f64").substr(8), "432");
    spoil("tris.i32", text_of(at / "tris.i32") + "1234", "tris.i32");
    spoil("obj.i32", "", "obj.i32");
    std::string positions = text_of(at / "pos.f64");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::memcpy(positions.data() + 8 * (18 + 3 * 4 + 1), &nan, 8);
    spoil("pos.f64", positions, "frame 1, vertex 4");
    std::string triangles = text_of(at / "tris.i32");
    triangles[0] = 9;
    spoil("tris.i32", triangles, "triangle 0 names vertex 9");
    for (const char* meta : {"", "nV 6\nnT 2\n", "nV 6\nnT 2\nframes 1\n", "nV -6\nnT 2\nframes 3\n", "nV 99999999999\nnT 2\nframes 3\n"})
        spoil("meta.txt", meta, "meta.txt");
    EXPECT_TRUE(refuses(contacts({"--frames", folder / "none"}), "meta.txt"));
}

class Ccd : public Program {};

/// A vertex that falls from 3 to -1 through the face, in thirds and halves that doubles hold exactly.
std::string falling_query(bool truth) {
    const std::string answer = truth ? ",1\n" : ",0\n";
    std::string text;
    for (const char* row :
         {"1,1,1,1,6,2", "0,1,0,1,0,1", "4,1,0,1,0,1", "0,1,4,1,0,1", "1,1,1,1,-2,2", "0,1,0,1,0,1", "4,1,0,1,0,1", "0,1,4,1,0,1"})
        text += row + answer;
    return text;
}

TEST_F(Ccd, CountsWrongAnswersOnItsLastLine) {
    const std::string right = write("vertex-face_right.csv", falling_query(true)), wrong = write("wrong.csv", falling_query(false));
    Ended ended = call({"ccd", right});
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("\n1 queries, 0 false positives, 0 false negatives, ")) << ended;
    EXPECT_TRUE(refuses(call({"ccd", wrong}), "--kind"));
    ended = call({"ccd", right, wrong, "--kind", "vertex-face"});
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("\n2 queries, 1 false positives, 0 false negatives, ")) << ended;
    EXPECT_TRUE(ended.out.ends_with(" ns worst\n")) << ended;
}

/// The same vertex, that stays above the face from 3 to 1: a stated contact there is one that no test finds.
std::string staying_query(bool truth) { return with(falling_query(truth), "-2,2,", "2,2,"); }

TEST_F(Ccd, AMissedContactIsExit5AndNamedByFileAndQuery) {
    const std::string missed =
        write("vertex-face_missed.csv", falling_query(true) + staying_query(false) + staying_query(true) + staying_query(true));
    const std::string fine = write("vertex-face_fine.csv", staying_query(false) + falling_query(false));
    Ended ended = call({"ccd", missed, fine});
    ASSERT_TRUE(ended_with(ended, 5));
    EXPECT_TRUE(ended.says("\n6 queries, 1 false positives, 2 false negatives, ")) << ended;
    EXPECT_TRUE(ended.says(missed + ": found no contact in query 3 of 4, expected one by its rows 17 to 24; 2 false negatives")) << ended;
    EXPECT_FALSE(ended.says(fine + ": found")) << ended;
    EXPECT_TRUE(ended_with(call({"ccd", fine}), 0)) << "a conservative test may report one too many";
}

TEST_F(Ccd, ReadsGzip) {
    const fs::path file = folder / "vertex-face.csv.gz";
    gzFile out = gzopen(file.c_str(), "wb");
    gzputs(out, falling_query(true).c_str());
    gzclose(out);
    EXPECT_TRUE(call({"ccd", file}).says("\n1 queries, 0 false positives"));
}

TEST_F(Ccd, RefusesBrokenFilesWithTheirLine) {
    const std::string good = falling_query(true);
    const auto broken = [&](const std::string& text, const char* expected) {
        EXPECT_TRUE(refuses(call({"ccd", write("vertex-face.csv", text)}), expected)) << text;
    };
    broken("", "no query");
    broken(good.substr(0, good.rfind("0,1,4")), "7 of its 8 rows");
    broken(with(good, "4,1,0,1,0,1,1", "4,1,0,1,0,1"), ":3: 6 columns");
    broken(with(good, "4,1,0,1,0,1,1", "4,0,0,1,0,1,1"), ":3: the denominator of x is 0");
    broken(with(good, "4,1,0,1,0,1,1", "4.5,1,0,1,0,1,1"), ":3: '4.5'");
    broken(with(good, "4,1,0,1,0,1,1", "4,1,0,1,0,1,2"), ":3: the answer is '2'");
    broken(with(good, "4,1,0,1,0,1,1", "4,1,0,1,0,1,0"), ":3: the answer differs");
    broken(with(good, "4,1,0,1,0,1,1", std::string(400, '9') + ",1,0,1,0,1,1"), ":3: x is beyond");
    EXPECT_TRUE(refuses(call({"ccd", folder / "vertex-face.none.csv"}), "none.csv"));
    EXPECT_TRUE(refuses(call({"ccd"}), "files"));
}

} // namespace
} // namespace trocar::cli_test
