// External programs: their limits, what is kept of their output, and that no process of them is left, whatever ends
// us.
#include "engine/io/file_bytes.hpp"
#include "engine/prepare/coarse.hpp"
#include "engine/prepare/process.hpp"
#include "engine/prepare/supervisor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <random>
#include <sstream>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

using testing::HasSubstr;

std::string run_shell(const std::string& script, double limit_s = 60.0) {
    const auto folder = TemporaryFolder::make();
    if (!folder.ok()) return "no folder";
    const auto outcome = run_process("/bin/sh", {"-c", script}, folder->path(), limit_s);
    if (!outcome.ok()) return outcome.error().message;
    return outcome->output;
}

/// Ids that a script has written, one a line.
std::vector<pid_t> read_ids(const std::string& text) {
    std::istringstream lines(text);
    std::vector<pid_t> ids;
    for (pid_t id = 0; lines >> id;) ids.push_back(id);
    return ids;
}

bool is_there(pid_t id) { return kill(id, 0) == 0 || errno != ESRCH; }

/// Three that outlive their parent: in its group, out of it, and out of it by way of one that ends.
constexpr const char* kFamily = "sleep 1000 & echo $!\n"
                                "setsid sleep 1000 & echo $!\n"
                                "(setsid sh -c 'sleep 1000 & echo $!; sleep 1000') & sleep 0.2\n";

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/// What `ulimit` says in a child of a process with this limit of address space.
std::string limits_under(rlim_t soft, rlim_t hard) {
    int ends[2];
    if (pipe(ends) != 0) return "no pipe";
    const pid_t child = fork();
    if (child == 0) {
        const rlimit limit{soft, hard};
        const std::string said = setrlimit(RLIMIT_AS, &limit) == 0 ? run_shell("ulimit -Sv; ulimit -Hv; ulimit -c") : "not set";
        _exit(write(ends[1], said.data(), said.size()) == static_cast<ssize_t>(said.size()) ? 0 : 1);
    }
    close(ends[1]);
    std::string said(200, '\0');
    const ssize_t count = read(ends[0], said.data(), said.size());
    close(ends[0]);
    said.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    EXPECT_EQ(waitpid(child, nullptr, 0), child);
    return said;
}

TEST(Process, AChildsLimitsAreTheSmallerOfOursAndThoseThatAreThere) {
    std::mt19937_64 random(4);
    std::uniform_int_distribution<rlim_t> mib(600, 16384);
    for (int k = 0; k < 24; ++k) {
        rlim_t soft = mib(random) << 20, hard = k % 3 == 0 ? RLIM_INFINITY : mib(random) << 20;
        rlimit now{};
        getrlimit(RLIMIT_AS, &now);
        hard = std::min(hard, now.rlim_max);
        soft = std::min(soft, hard);
        const rlim_t most = kToolMemory;
        const std::string expected =
            std::to_string(std::min(soft, most) >> 10) + "\n" + std::to_string(std::min(hard, most) >> 10) + "\n0\n";
        EXPECT_EQ(limits_under(soft, hard), expected) << "soft " << soft << ", hard " << hard;
    }
}
#endif

TEST(Process, OnlyTheEndOfWhatItPrintsIsKeptAndNothingIsWritten) {
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    const auto outcome = run_process(
        "/bin/sh", {"-c", "yes 0123456789 | head -c 30000000; yes 0123456789 | head -c 3000000 >&2; echo the end"}, folder->path(), 120.0);
    ASSERT_TRUE(outcome.ok()) << outcome.error().to_string();
    EXPECT_EQ(outcome->exit_code, 0);
    EXPECT_LE(outcome->output.size(), 4096u);
    EXPECT_TRUE(outcome->output.ends_with("the end\n")) << outcome->output;
    EXPECT_TRUE(std::filesystem::is_empty(folder->path())) << "a log";
}

TEST(Process, ItsDescendantsEndWithItWhereverTheyWent) {
    const std::vector<pid_t> ids = read_ids(run_shell(kFamily));
    ASSERT_EQ(ids.size(), 3u);
    for (const pid_t id : ids) EXPECT_FALSE(is_there(id)) << id;
}

TEST(Process, ItsDescendantsEndAtTheTimeLimitToo) {
    const std::vector<pid_t> ids = read_ids(run_shell(std::string(kFamily) + "wait; sleep 1000", 1.0));
    ASSERT_EQ(ids.size(), 3u);
    for (const pid_t id : ids) EXPECT_FALSE(is_there(id)) << id;
}

TEST(Process, ItsDescendantsEndWithUsWhenWeAreKilled) {
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    const std::filesystem::path told = folder->path() / "ids";
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        (void)run_process("/bin/sh", {"-c", "(" + std::string(kFamily) + ") > ids; mv ids all; sleep 1000"}, folder->path(), 1000.0);
        _exit(0);
    }
    for (int look = 0; look < 3000 && !std::filesystem::exists(folder->path() / "all"); ++look) usleep(10'000);
    const auto text = read_file_bytes(folder->path() / "all");
    kill(child, SIGKILL);
    ASSERT_EQ(waitpid(child, nullptr, 0), child);
    ASSERT_TRUE(text.ok());
    const std::vector<pid_t> ids = read_ids(*text);
    ASSERT_EQ(ids.size(), 3u);
    for (const pid_t id : ids) {
        for (int look = 0; look < 3000 && is_there(id); ++look) usleep(10'000);
        EXPECT_FALSE(is_there(id)) << id;
    }
}

TEST(Process, ThatClosesItsOutputsIsStillWaitedFor) {
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    const auto outcome = run_process("/bin/sh", {"-c", "exec >&- 2>&-; sleep 0.3; exit 7"}, folder->path(), 60.0);
    ASSERT_TRUE(outcome.ok());
    EXPECT_EQ(outcome->exit_code, 7);
}

/// An octahedron divided once: closed, and coarse enough for every share of 20 triangles.
TriMesh make_octahedron() {
    TriMesh mesh;
    mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return mesh;
}

/// What a mesher of so few lines of shell makes of an octahedron. Every try adds a line to the file "begun" before it runs the script.
struct ScriptedTries {
    Error error;
    std::string begun;
};
ScriptedTries try_scripted(const std::string& script, double time_limit) {
    const auto folder = TemporaryFolder::make();
    const std::filesystem::path program = folder->path() / "mesher", begun = folder->path() / "begun";
    std::ofstream(program) << "#!/bin/sh\nbegun=" << begun.string() << "\necho x >> $begun\n" << script << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    CoarseOptions options;
    options.use_cache = false;
    options.tetgen.time_limit = time_limit;
    options.tetgen.program = program.string();
    const auto mesh = make_coarse_mesh(make_octahedron(), options);
    EXPECT_FALSE(mesh.ok());
    return {mesh.ok() ? Error{} : mesh.error(), read_file_bytes(begun).value()};
}

TEST(Coarse, AMesherThatHangsIsTriedOnce) {
    const auto [error, begun] = try_scripted("yes", 0.5);
    EXPECT_EQ(error.code, ErrorCode::ToolFailed);
    EXPECT_THAT(error.message, HasSubstr("within 0.5 s, the time limit of each try (try 1 of at most 5)"));
    EXPECT_LT(error.message.size(), 1000u);
    EXPECT_EQ(begun, "x\n");
}

TEST(Coarse, EveryTryHasATimeLimitOfItsOwnSoThatTheirNumberIsTheSameOnASlowMachine) {
    const auto [error, begun] = try_scripted("sleep 0.6; exit 3", 2.0);
    EXPECT_EQ(error.code, ErrorCode::ToolFailed);
    EXPECT_THAT(error.message, HasSubstr("exit code 3"));
    EXPECT_EQ(begun, "x\nx\nx\nx\nx\n");
}

TEST(Coarse, ALaterTryThatRunsOutOfTimeIsAnErrorThatNamesIt) {
    const auto [error, begun] = try_scripted("if [ $(wc -l < $begun) -lt 3 ]; then exit 3; fi; yes", 1.5);
    EXPECT_EQ(error.code, ErrorCode::ToolFailed);
    EXPECT_THAT(error.message, HasSubstr("within 1.5 s, the time limit of each try (try 3 of at most 5)"));
    EXPECT_EQ(begun, "x\nx\nx\n");
}

} // namespace
} // namespace trocar::engine
