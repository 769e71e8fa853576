#include "engine/viewer/picks.hpp"

#include "engine/io/shown.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine::viewer {

Result<void> check_file_name(std::string_view name) {
    const auto plain = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
    };
    if (!name.empty() && name.size() <= kLongestFileName && name.front() != '.' && std::all_of(name.begin(), name.end(), plain)) return {};
    return Error{ErrorCode::BadValue, fmt::format("the name of the file is \"{}\"; expected 1 to {} letters, digits, - _ and dots, no dot at the front",
                                                  shown(name), kLongestFileName)};
}

} // namespace trocar::engine::viewer
