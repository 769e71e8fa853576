#include "engine/cli/taken_files.hpp"

namespace trocar::engine {

bool is_same_place(const std::filesystem::path& one, const std::filesystem::path& other) {
    std::error_code failed;
    const auto place = [&](const std::filesystem::path& path) {
        const std::filesystem::path whole = std::filesystem::weakly_canonical(std::filesystem::absolute(path, failed), failed);
        return whole.has_filename() ? whole : whole.parent_path(); // DIR/ is DIR
    };
    const std::filesystem::path here = place(one);
    return !here.empty() && here == place(other);
}

Result<void> check_not_taken(const std::filesystem::path& file, std::span<const std::filesystem::path> taken, std::string option) {
    for (const std::filesystem::path& other : taken) {
        std::error_code unknown; // a file that is not there yet is like none
        if (std::filesystem::equivalent(file, other, unknown) || is_same_place(file, other))
            return Error{ErrorCode::BadUsage, file.string() + " is read, or written as something else; expected another file", {}, 0, 0,
                         std::move(option)};
    }
    return {};
}

} // namespace trocar::engine
