// Ctrl-C before the first step: exit 130 with a sentence, and no program, file or folder of the work is left.
#include "program.hpp"

#include <functional>
#include <optional>

namespace trocar::cli_test {
namespace {

/// An environment variable for the programs that a test starts.
class Environment {
public:
    Environment(const char* name, const std::string& value) : name_(name) {
        if (const char* before = std::getenv(name)) before_ = before;
        setenv(name, value.c_str(), 1);
    }
    Environment(const Environment&) = delete;
    Environment& operator=(const Environment&) = delete;
    ~Environment() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }

private:
    const char* name_;
    std::optional<std::string> before_;
};

bool soon(const std::function<bool()>& holds) {
    for (int wait = 0; wait < 6000 && !holds(); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return holds();
}

/// Neither running nor a zombie.
bool is_gone(pid_t process) {
    const std::string stat = text_of("/proc/" + std::to_string(process) + "/stat");
    return stat.empty() || stat.find(") Z ") != std::string::npos;
}

bool catches(pid_t process, int signal) {
    const std::string status = text_of("/proc/" + std::to_string(process) + "/status"), key = "SigCgt:\t";
    const std::size_t at = status.find(key);
    return at != std::string::npos && (std::stoull(status.substr(at + key.size(), 16), nullptr, 16) >> (signal - 1) & 1) != 0;
}

const std::string kSoftBall = R"({
  "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 0.05}, "budget": "exact",
  "bodies": {"ball": {"kind": "deformable", "surface": {"shape": "sphere", "radius": 30, "subdivisions": 2},
    "material": {"young_modulus": 20, "density": 1000}, "coarse": {"mesher": "tetgen", "surface_triangles": 80, "max_volume": 500}}},
  "effects": ["elasticity"]
})";

/// A stand-in for TetGen that never ends and has a child of its own.
class Interrupted : public Program {
protected:
    Interrupted() {
        fs::create_directories(folder / "bin");
        fs::create_directories(folder / "tmp");
        write("bin/tetgen", "#!/bin/sh\nsleep 1000 &\necho $$ $! > " + (folder / "started.part").string() + "; mv " +
                                (folder / "started.part").string() + " " + started.string() + "\nwait\n");
        fs::permissions(folder / "bin/tetgen", fs::perms::owner_all);
    }
    /// Its process ids, once it runs.
    std::vector<pid_t> wait_for_mesher() const {
        std::vector<pid_t> found;
        if (!soon([&] { return fs::exists(started); })) return found;
        std::istringstream text(text_of(started));
        for (pid_t id = 0; text >> id;) found.push_back(id);
        return found;
    }
    fs::path started = folder / "started";
    Environment path{"PATH", (folder / "bin").string() + ":/usr/bin:/bin"}, tmp{"TMPDIR", (folder / "tmp").string()},
        cache{"TROCAR_CACHE", (folder / "cache").string()};
};

TEST_F(Interrupted, APreparationEndsTheMesherAndRemovesItsFolder) {
    const std::string scene = write("ball.json", kSoftBall);
    write("list.txt", "ball.json 2 0\n");
    const std::string surface = write("octahedron.off", "OFF\n6 8 0\n1 0 0\n-1 0 0\n0 1 0\n0 -1 0\n0 0 1\n0 0 -1\n3 0 2 4\n3 2 1 4\n"
                                                        "3 1 3 4\n3 3 0 4\n3 2 0 5\n3 1 2 5\n3 3 1 5\n3 0 3 5\n");
    const std::vector<std::vector<std::string>> commands = {{"run", scene, "--out", out(), "-n", "3"},
                                                            {"explain", scene},
                                                            {"cost", scene, "--out", out(), "-n", "3"},
                                                            {"verify", folder / "list.txt", "--write-references"},
                                                            {"prepare", surface, "--out", out(), "--coarse-triangles", "20"}};
    for (const std::vector<std::string>& command : commands) {
        fs::remove(started);
        const pid_t child = start(command);
        const std::vector<pid_t> mesher = wait_for_mesher();
        EXPECT_EQ(mesher.size(), 2u) << command[0];
        ASSERT_EQ(send_signal(child, SIGINT), 0);
        const Ended ended = wait_for(child, 30.0);
        EXPECT_TRUE(ended_with(ended, 130)) << command[0];
        EXPECT_NE(ended.err.find("interrupted: ends as soon as it can"), std::string::npos) << command[0] << ": " << ended;
        EXPECT_EQ(ended.err.find("error"), std::string::npos) << ended;
        for (const pid_t id : mesher) EXPECT_TRUE(soon([&] { return is_gone(id); })) << command[0] << ": " << id << " runs on";
        EXPECT_TRUE(fs::is_empty(folder / "tmp")) << command[0];
    }
}

TEST_F(Interrupted, AProgramThatIsKilledDoesNotLeaveItsMesherBehind) {
    const pid_t child = start({"explain", write("ball.json", kSoftBall)});
    const std::vector<pid_t> mesher = wait_for_mesher();
    ASSERT_EQ(mesher.size(), 2u);
    ASSERT_EQ(send_signal(child, SIGKILL), 0);
    EXPECT_EQ(wait_for(child, 30.0).signal, SIGKILL);
    EXPECT_TRUE(soon([&] { return is_gone(mesher[0]); }));
    send_signal(mesher[1], SIGKILL); // the stand-in's own child is not checked
}

TEST_F(Interrupted, WorkWithNothingToPutAwayEndsAtOnce) {
    const std::string heavy = write("heavy.json", R"({"units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 1},
        "bodies": {"ball": {"kind": "static", "surface": {"shape": "sphere", "radius": 30, "subdivisions": 7}}},
        "effects": ["coarse_contact"]})");
    for (const std::vector<std::string>& command : {std::vector<std::string>{"explain", heavy}, {"run", heavy, "--out", out()}}) {
        const pid_t child = start(command);
        ASSERT_TRUE(soon([&] { return catches(child, SIGINT); }));
        ASSERT_EQ(send_signal(child, SIGINT), 0);
        const Ended ended = wait_for(child, 30.0);
        EXPECT_TRUE(ended_with(ended, 130));
        EXPECT_EQ(ended.err, "interrupted: ended before it was done\n");
        EXPECT_FALSE(fs::exists(out()));
    }
}

TEST_F(Interrupted, AFilmIsWrittenOfTheFramesThatWereTaken) {
    const std::string scene = write("tube.json", kTube), film = folder / "film.png";
    Ended ended;
    for (int ms = 500; ms <= 16'000 && !fs::exists(film); ms *= 2) { // what is interrupted before its first frame ends without a film
        const pid_t child = start({"film", scene, "--out", film, "-n", "100000000", "--every", "100000"});
        std::this_thread::sleep_for(std::chrono::milliseconds(ms));
        ASSERT_EQ(send_signal(child, SIGINT), 0);
        ended = wait_for(child, kPatience);
        EXPECT_TRUE(ended_with(ended, 130));
    }
    EXPECT_TRUE(fs::exists(film)) << ended;
    EXPECT_TRUE(ended.says(" frames of 256 x 256 pixels")) << ended;
}

TEST_F(Interrupted, MoreTetrahedraThanWouldBeTakenAreRefusedBeforeTheMesherStarts) {
    const Ended ended = call({"explain", write("fine.json", with(kSoftBall, "\"max_volume\": 500", "\"max_volume\": 1e-10"))});
    EXPECT_TRUE(refuses(ended, "bodies.ball.coarse.max_volume: 1e-10 mm^3 asks for "));
    EXPECT_TRUE(ended.says("e+15 tetrahedra or more of a body of ")) << ended;
    EXPECT_TRUE(ended.says("at most 5000000 would be taken; expected 0.0")) << ended;
    EXPECT_FALSE(fs::exists(started));
}

} // namespace
} // namespace trocar::cli_test
