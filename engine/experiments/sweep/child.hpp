// One run in a process of its own: whatever happens to it happens to nothing else, and it ends when we do.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

struct ChildEnd {
    int exit_code = -1; // when it ended by itself
    int signal = 0;     // when it was killed by one
    bool timed_out = false, interrupted = false; // then we killed it
    std::string output; // the end of what it printed
};

/// This same program, started in `folder`.
/// time_limit  s; 0: none
/// fails       ToolFailed: it could not be started
[[nodiscard]] Result<ChildEnd> run_this_program(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                                                double time_limit);

} // namespace trocar::engine
