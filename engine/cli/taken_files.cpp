#include "engine/cli/taken_files.hpp"

namespace trocar::engine {

Result<void> check_not_taken(const std::filesystem::path& file, std::span<const std::filesystem::path> taken, std::string option) {
    for (const std::filesystem::path& other : taken) {
        std::error_code unknown; // a file that is not there yet is like none
        if (std::filesystem::equivalent(file, other, unknown) || file.lexically_normal() == other.lexically_normal())
            return Error{ErrorCode::BadUsage, file.string() + " is read, or written by another option; another file is wanted", {}, 0, 0,
                         std::move(option)};
    }
    return {};
}

} // namespace trocar::engine
