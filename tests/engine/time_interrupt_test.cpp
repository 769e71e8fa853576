// What Ctrl-C does to the program: the end at once, or a flag for an owner with output to finish. Death tests: each in a process.
#include "engine/prepare/process.hpp"
#include "engine/time/interrupt.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include <unistd.h>

namespace trocar::engine {
namespace {

class Interrupt : public testing::Test {
protected:
    void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
    /// Fails where the program went on.
    [[noreturn]] static void end(const char* told) {
        std::fputs(told, stderr);
        std::_Exit(1);
    }
};

TEST_F(Interrupt, EndsTheProgramAtOnceWhereItIsNotHeld) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        EXPECT_EXIT(
            {
                catch_interrupts();
                std::raise(signal);
                end("went on");
            },
            testing::ExitedWithCode(130), "^interrupted: ended before it was done\n$");
}

TEST_F(Interrupt, IsAFlagWhileItIsHeldAndTheSecondOneEndsTheProgram) {
    EXPECT_EXIT(
        {
            catch_interrupts();
            const InterruptHold hold(InterruptHold::Then::OwnerEnds);
            if (interrupt_requested()) end("requested before anybody asked");
            std::raise(SIGINT);
            if (!interrupt_requested()) end("not requested");
            std::fputs("goes on\n", stderr);
            std::raise(SIGINT);
            end("went on");
        },
        testing::ExitedWithCode(130), "^interrupted: ends as soon as it can; once more ends it at once\ngoes on\n$");
}

TEST_F(Interrupt, EndsTheProgramWithTheLastHoldUnlessAnOwnerSeesToIt) {
    EXPECT_EXIT(
        {
            catch_interrupts();
            {
                const InterruptHold owner(InterruptHold::Then::OwnerEnds);
                { const InterruptHold part(InterruptHold::Then::End); }
                std::raise(SIGINT);
                { const InterruptHold part(InterruptHold::Then::End); }
            }
            std::fputs("the owner goes on\n", stderr);
            { const InterruptHold part(InterruptHold::Then::End); }
            end("went on");
        },
        testing::ExitedWithCode(130), "the owner goes on\n$");
}

TEST_F(Interrupt, KillsTheProgramThatRunsAndRemovesItsFolder) {
    const std::filesystem::path told = std::filesystem::path(testing::TempDir()) / "trocar-interrupted-folder.txt";
    EXPECT_EXIT(
        {
            catch_interrupts();
            const auto folder = TemporaryFolder::make();
            std::ofstream(told) << folder->path().string() << std::flush;
            std::thread([] {
                usleep(100'000);
                kill(getpid(), SIGINT);
            }).detach();
            const auto outcome = run_process("/bin/sleep", {"100"}, folder->path(), 60.0);
            if (!outcome.ok() || !outcome->interrupted || outcome->timed_out || outcome->signal != SIGKILL) end("not killed");
            std::fputs("killed\n", stderr);
            std::filesystem::remove(told);
            std::ofstream(told) << folder->path().string() << std::flush;
        },
        testing::ExitedWithCode(130), "killed\n$");
    std::string folder;
    std::ifstream(told) >> folder;
    EXPECT_FALSE(folder.empty());
    EXPECT_FALSE(std::filesystem::exists(folder)) << folder;
    std::filesystem::remove(told);
}

TEST(Process, ThatCannotBeStartedSaysWhy) {
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    const std::filesystem::path text = folder->path() / "no-program";
    std::ofstream(text) << "some text";
    std::filesystem::permissions(text, std::filesystem::perms::owner_all);
    const auto outcome = run_process(text, {}, folder->path(), 5.0);
    ASSERT_FALSE(outcome.ok());
    EXPECT_NE(outcome.error().message.find("no-program: Exec format error"), std::string::npos) << outcome.error().message;
    EXPECT_FALSE(run_process("/bin/true", {}, folder->path() / "nowhere", 5.0).ok());
}

} // namespace
} // namespace trocar::engine
