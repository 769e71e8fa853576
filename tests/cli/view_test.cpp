// `trocar view` from the command line: its address, its end, and what it refuses.
#include "program.hpp"

namespace trocar::cli_test {
namespace {

class View : public Program {
protected:
    fs::path scene = write("tube.json", kTube);
    fs::path page = write("page.html", "<!doctype html>");
};

TEST_F(View, PrintsItsAddressWithATokenAndEndsAfterItsSteps) {
    const Ended ended = call({"view", scene.string(), "--page", page.string(), "-n", "5", "--quiet"});
    ASSERT_TRUE(ended_with(ended, 0));
    const std::string line = ended.out.substr(0, ended.out.find('\n'));
    EXPECT_EQ(line.rfind("http://127.0.0.1:", 0), 0u) << line;
    const std::size_t at = line.find("/?token=");
    ASSERT_NE(at, std::string::npos) << line;
    EXPECT_GE(line.size() - at - 8, 16u) << line;
    EXPECT_TRUE(ended.says("5 steps, step p50/p95/p99/max")) << ended;
}

TEST_F(View, EndsWellWhenInterrupted) {
    const pid_t child = start({"view", scene.string(), "--page", page.string(), "--quiet", "--paused"});
    while (text_of(folder / "stdout").find('\n') == std::string::npos && waitpid(child, nullptr, WNOHANG) == 0)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    send_signal(child, SIGINT);
    const Ended ended = wait_for(child, kPatience);
    EXPECT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("0 steps")) << ended;
}

TEST_F(View, TakesNoStepBeforeTheFirstViewerUnlessItIsToldTo) {
    const pid_t child = start({"view", scene.string(), "--page", page.string()});
    while (text_of(folder / "stdout").find("Ctrl-C") == std::string::npos && waitpid(child, nullptr, WNOHANG) == 0)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    std::this_thread::sleep_for(std::chrono::milliseconds(500)); // some fifty steps, if it took any
    send_signal(child, SIGINT);
    const Ended ended = wait_for(child, kPatience);
    EXPECT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("the first step waits for it")) << ended;
    EXPECT_TRUE(ended.says("\n0 steps, ")) << ended;
    EXPECT_TRUE(call({"view", scene.string(), "--page", page.string(), "-n", "3"}).says("\n3 steps, "))
        << "with a number of steps there is no viewer";
    EXPECT_TRUE(call({"view", scene.string(), "--page", page.string(), "-n", "3", "--at-once"}).says("\n3 steps, "));
}

TEST_F(View, RefusesWhatItCannotServe) {
    const auto view = [&](std::vector<std::string> more) {
        std::vector<std::string> arguments = {"view", scene.string(), "--page", page.string(), "-n", "1"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return call(arguments);
    };
    EXPECT_TRUE(refuses(view({"--port", "70000"}), "--port"));
    EXPECT_TRUE(refuses(view({"--address", "nowhere"}), "127.0.0.1"));
    EXPECT_TRUE(refuses(view({"--budget", "7"}), "--budget"));
    EXPECT_TRUE(refuses(view({"-n", "0"}), "--steps"));
    EXPECT_TRUE(refuses(view({"--igtl", "0", "--igtl-rate", "nan"}), "--igtl-rate"));
    EXPECT_TRUE(refuses(call({"view", (folder / "none.json").string(), "--page", page.string()}), "none.json"));
    EXPECT_TRUE(refuses(call({"view", scene.string(), "--page", (folder / "none.html").string()}), "none.html"));
}

TEST_F(View, WithoutItsPageSaysWhatBuildsIt) {
    const fs::path alone = folder / "bin" / "trocar"; // the program without what stands beside it
    fs::create_directory(folder / "bin");
    fs::copy_file(TROCAR_PROGRAM, alone);
    const Ended ended = wait_for(start({"view", scene.string(), "-n", "1"}, alone), kPatience);
    EXPECT_TRUE(refuses(ended, "page was not built"));
    EXPECT_TRUE(ended.says("viewer_page")) << "what builds it: " << ended;
    EXPECT_TRUE(ended.says("page/index.html")) << "what is missing: " << ended;
}

} // namespace
} // namespace trocar::cli_test
