// Runs one external program to its end or to a time limit, without a shell.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace seldinger::engine {

struct ProcessOutcome {
    bool timed_out = false;
    int exit_code = -1; // when it ended by itself
    int signal = 0;     // when it was killed by one
    std::string output; // the last few KiB of stdout and stderr together
};

/// Absolute path of a program in PATH (or of a path given as such); MissingTool otherwise.
[[nodiscard]] Result<std::filesystem::path> find_program(const std::string& name, const std::string& package);

/// Runs in `folder`; kills the whole process group at the limit. ToolFailed only when it could not be started.
[[nodiscard]] Result<ProcessOutcome> run_process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                                 const std::filesystem::path& folder, double time_limit);

/// A private folder under the system's temporary one, removed with everything in it when this goes.
class TemporaryFolder {
public:
    [[nodiscard]] static Result<TemporaryFolder> make();
    TemporaryFolder(TemporaryFolder&& other) noexcept;
    TemporaryFolder& operator=(TemporaryFolder&&) = delete;
    ~TemporaryFolder();
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

private:
    explicit TemporaryFolder(std::filesystem::path path) : path_(std::move(path)) {}
    std::filesystem::path path_;
};

} // namespace seldinger::engine
