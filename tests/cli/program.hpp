// Runs the built program as a user does: arguments in, exit code, output and files out. Never waits for ever.
#pragma once

#include "tests/temp_folder.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <csignal>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace trocar::cli_test {

namespace fs = std::filesystem;
using Json = nlohmann::json;

inline std::string text_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
}

struct Ended {
    int exit_code = -1; // when it ended by itself
    int signal = 0;     // when a signal ended it
    bool timed_out = false;
    std::string out, err;

    [[nodiscard]] std::string all() const { return out + err; }
    [[nodiscard]] bool says(const std::string& piece) const { return all().find(piece) != std::string::npos; }
};

inline std::ostream& operator<<(std::ostream& os, const Ended& ended) {
    return os << "exit " << ended.exit_code << ", signal " << ended.signal << (ended.timed_out ? ", timed out" : "") << "\n"
              << ended.out << ended.err;
}

/// s until a program counts as hanging: far more than any takes, also on a busy machine.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kPatience = 900.0;
#else
constexpr double kPatience = 300.0;
#endif

/// A program that never started has no process: kill(-1) would end every one that there is.
inline int send_signal(pid_t process, int signal) { return process > 0 ? ::kill(process, signal) : -1; }

/// A run in a folder of its own, which goes away with it.
class Program : public FolderTest {
protected:
    /// Starts the program; output goes to files, so that no pipe can fill up.
    pid_t start(const std::vector<std::string>& arguments, const fs::path& program = TROCAR_PROGRAM) const {
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&actions, 1, (folder / "stdout").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        posix_spawn_file_actions_addopen(&actions, 2, (folder / "stderr").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        std::vector<char*> argv = {const_cast<char*>(program.c_str())};
        for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
        argv.push_back(nullptr);
        pid_t child = -1;
        const int failed = posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
        EXPECT_EQ(failed, 0) << program;
        if (failed != 0) child = -1;
        posix_spawn_file_actions_destroy(&actions);
        return child;
    }

    Ended wait_for(pid_t child, double limit_s) const {
        using Time = std::chrono::steady_clock;
        const auto end = Time::now() + std::chrono::duration<double>(limit_s);
        Ended ended;
        if (child <= 0) return ended; // never started: exit -1
        int status = 0;
        while (waitpid(child, &status, WNOHANG) == 0) {
            if (Time::now() > end && !ended.timed_out) {
                ended.timed_out = true;
                send_signal(child, SIGKILL);
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        if (WIFEXITED(status)) ended.exit_code = WEXITSTATUS(status);
        if (WIFSIGNALED(status)) ended.signal = WTERMSIG(status);
        ended.out = text_of(folder / "stdout");
        ended.err = text_of(folder / "stderr");
        return ended;
    }

    Ended call(const std::vector<std::string>& arguments, double limit_s = kPatience) const { return wait_for(start(arguments), limit_s); }

    /// `run` into out/, without pictures.
    Ended run(const fs::path& scene, std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments = {"run", scene.string(), "--out", out().string(), "--no-pictures"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return call(arguments);
    }

    [[nodiscard]] fs::path out() const { return folder / "out"; }
    /// The summary says that this output is not there; where it could not be written either, nothing looks finished.
    [[nodiscard]] bool names_as_missing(const std::string& output) const {
        if (!fs::exists(out() / "summary.json")) return true;
        const Json json = summary();
        if (!json.is_object() || !json.contains("missing_outputs")) return false;
        for (const Json& sentence : json["missing_outputs"])
            if (sentence.get<std::string>().find(output) != std::string::npos) return true;
        return false;
    }
    [[nodiscard]] Json summary() const { return Json::parse(text_of(out() / "summary.json"), nullptr, false); }

};

/// Until a run that writes into `out` has taken steps; false: it never did.
inline bool wait_for_steps(const fs::path& out, std::uintmax_t bytes = 2000) {
    for (int wait = 0; wait < 6000; ++wait) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        std::error_code none;
        for (const auto& entry : fs::directory_iterator(out, none))
            if (entry.path().filename().string().find("steps") != std::string::npos && entry.file_size(none) > bytes) return true;
    }
    return false;
}

/// A wire in a straight tube: 20 steps, prepared in a few hundredths of a second.
inline const std::string kTube = R"({
    "name": "tube",
    "units": {"length": "mm", "pressure": "MPa"},
    "time": {"step": 0.01, "duration": 0.2},
    "budget": "exact",
    "bodies": {"tube": {"kind": "static", "hollow": true,
        "surface": {"shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 120, 4]], "sides": 16}}},
    "instruments": {"wire": {"length": 100, "radius": 0.5, "young_modulus": 60, "segment": 5, "skin_triangles": 600,
        "tip": {"shape": "J", "length": 12, "angle": 0.6}, "lumen": "tube",
        "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]}, "path": [[0, 20, 0], [0.2, 26, 0.4]]}},
    "effects": ["coarse_contact", "exact_contact"]
})";

/// The text with one piece replaced; the piece must be there.
inline std::string with(std::string text, const std::string& piece, const std::string& other) {
    const std::size_t at = text.find(piece);
    EXPECT_NE(at, std::string::npos) << piece;
    if (at != std::string::npos) text.replace(at, piece.size(), other);
    return text;
}

inline testing::AssertionResult ended_with(const Ended& ended, int code) {
    if (ended.exit_code == code && ended.signal == 0 && !ended.timed_out) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "expected exit " << code << ", got " << ended;
}

/// Exit 2 with a message that starts with "error:" or comes from the command line, and says `piece`.
inline testing::AssertionResult refuses(const Ended& ended, const std::string& piece) {
    if (const auto ok = ended_with(ended, 2); !ok) return ok;
    if (ended.err.empty()) return testing::AssertionFailure() << "exit 2 without a word";
    if (!ended.says(piece)) return testing::AssertionFailure() << "\"" << piece << "\" is not in: " << ended.all();
    return testing::AssertionSuccess();
}

} // namespace trocar::cli_test
