#include "observe_fixture.hpp"

#include "engine/report/output_folder.hpp"

#include <csignal>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trocar::engine::test {

class OutputFolders : public Folder {};

TEST_F(OutputFolders, AreMadeWithTheirParents) {
    const Result<OutputFolder> folder = OutputFolder::open(out / "a" / "b", false);
    ASSERT_TRUE(folder.ok()) << folder.error().to_string();
    EXPECT_TRUE(fs::is_directory(out / "a" / "b"));
}

TEST_F(OutputFolders, WithFilesInThemAreRefusedAndLeftAsTheyWere) {
    write("notes.txt", "mine");
    const Result<OutputFolder> folder = OutputFolder::open(out, false);
    ASSERT_FALSE(folder.ok());
    EXPECT_EQ(folder.error().code, ErrorCode::CannotWrite);
    EXPECT_NE(folder.error().message.find("--force"), std::string::npos);
    EXPECT_NE(folder.error().message.find("notes.txt"), std::string::npos);
    EXPECT_EQ(names(), std::vector<std::string>{"notes.txt"});
}

TEST_F(OutputFolders, LoseOnlyOldOutputsWhenForced) {
    for (const char* ours :
         {"steps.csv", "steps.csv.partial", "summary.json", "report.html", "anatomy_01_t04.20s.png", "fluoro_12_t100.00s.png",
          ".steps.csv.123.0.part", "record/00_liver_000010.vtp", "record/states.pvd", "last_good_state/00_liver_coarse.vtu"})
        write(ours, "old");
    for (const char* theirs : {"notes.txt", "anatomy.png", "my_steps.csv", "record/measurements.xlsx", "data/steps.csv"})
        write(theirs, "mine");
    const Result<OutputFolder> folder = OutputFolder::open(out, true);
    ASSERT_TRUE(folder.ok()) << folder.error().to_string();
    EXPECT_EQ(names(), (std::vector<std::string>{".trocar.lock", "anatomy.png", "data", "my_steps.csv", "notes.txt", "record"}));
    EXPECT_TRUE(fs::exists(out / "record" / "measurements.xlsx"));
    EXPECT_FALSE(fs::exists(out / "record" / "states.pvd"));
    EXPECT_TRUE(fs::exists(out / "data" / "steps.csv"));
}

TEST_F(OutputFolders, AreRefusedWhereAFileThatIsReadWouldBeRemoved) {
    for (const char* file : {"plan.json", "record/00_liver.vtp", "fluoro/ap_000010.png", "notes.txt", "record/measurements.xlsx", "checkpoint.bin"})
        write(file, "read");
    fs::create_symlink(out / "plan.json", out / "link.json");
    const auto taken = [&](const fs::path& file, const char* keep = nullptr) { return OutputFolder::check(out, true, {&file, 1}, keep).ok(); };
    for (const char* file : {"plan.json", "link.json", "record/../plan.json", "record/00_liver.vtp", "fluoro/ap_000010.png", "checkpoint.bin"})
        EXPECT_FALSE(taken(out / file)) << file;
    for (const char* file : {"notes.txt", "record/measurements.xlsx", "path.csv"}) EXPECT_TRUE(taken(out / file)) << file;
    EXPECT_TRUE(taken(out / "checkpoint.bin", "checkpoint.bin"));
    EXPECT_TRUE(taken({}));
}

TEST_F(OutputFolders, DoNotFollowALinkOutOfThemselves) {
    write("record_elsewhere/precious.vtp", "mine");
    write("run/steps.csv", "old");
    fs::create_directory_symlink(out / "record_elsewhere", out / "run" / "record");
    ASSERT_TRUE(OutputFolder::open(out / "run", true).ok());
    EXPECT_TRUE(fs::exists(out / "record_elsewhere" / "precious.vtp"));
}

TEST_F(OutputFolders, BelongToOneRunAtATimeEvenWhenForced) {
    Result<OutputFolder> first = OutputFolder::open(out, false);
    ASSERT_TRUE(first.ok());
    for (const bool force : {false, true}) {
        const Result<OutputFolder> second = OutputFolder::open(out, force);
        ASSERT_FALSE(second.ok());
        EXPECT_NE(second.error().message.find("another run"), std::string::npos);
    }
    { const OutputFolder ended = std::move(*first); }
    EXPECT_TRUE(OutputFolder::open(out, false).ok());
    EXPECT_TRUE(fs::is_empty(out)) << "the lock stays behind";
}

TEST_F(OutputFolders, OfKilledRunsAreFree) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        const Result<OutputFolder> held = OutputFolder::open(out, false);
        raise(SIGKILL);
        _exit(1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    ASSERT_TRUE(fs::exists(out / ".trocar.lock")) << "the child did not come so far";
    EXPECT_TRUE(OutputFolder::open(out, false).ok());
}

TEST_F(OutputFolders, AreRefusedWhereAFileIsInTheWay) {
    write("file", "text");
    for (const fs::path& path : {out / "file", out / "file" / "below"}) {
        const Result<OutputFolder> folder = OutputFolder::open(path, true);
        ASSERT_FALSE(folder.ok());
        EXPECT_EQ(folder.error().code, ErrorCode::CannotWrite);
        EXPECT_EQ(folder.error().file, path.string());
    }
    EXPECT_FALSE(OutputFolder::open("", false).ok());
}

TEST_F(OutputFolders, ThatCannotBeWrittenAreAnError) {
    const Result<OutputFolder> folder = OutputFolder::open("/proc/self/nowhere", false);
    ASSERT_FALSE(folder.ok());
    EXPECT_EQ(folder.error().code, ErrorCode::CannotWrite);
}

/// The limit of a file's size stands for a full disk: the same call fails, at the same place.
TEST_F(OutputFolders, ThatAreFullAreToldInTheSummaryAndNotACrash) {
    const TinyRun& run = tube_run();
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit little{2000, 2000};
        setrlimit(RLIMIT_FSIZE, &little);
        const Result<RunSummary> summary = run.into(out, 20);
        const bool all_missing = summary.ok() && summary->steps == 20 && summary->missing_outputs.size() == 3;
        _exit(all_missing && summary->missing_outputs[0].starts_with("steps.csv is missing: ") ? 7 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 7);
    EXPECT_FALSE(fs::exists(out / "steps.csv"));
    EXPECT_FALSE(fs::exists(out / "summary.json"));
    EXPECT_FALSE(fs::exists(out / ".trocar.lock"));
}

} // namespace trocar::engine::test
