// The house as rules over text: which room may include which, and what may stand below the top floor.
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::house {

inline constexpr std::array<std::string_view, 6> kRooms{"base", "fem", "spheretree", "collision", "assets", "engine"};

/// Wings of engine/, lowest first: each may include those before it. So io knows no other wing, and step knows nothing of
/// gpu, observe, viewer and cli.
inline constexpr std::array<std::string_view, 10> kWings{"io",  "time",    "scene", "prepare", "step",
                                                         "gpu", "observe", "bench", "viewer",  "cli"};

struct Place {
    std::string room; // empty: not one of ours
    std::string wing; // engine only; empty for a file right in engine/
};

inline Place place_of(const std::string& path) {
    const std::size_t first = path.find('/');
    const std::string room = path.substr(0, first);
    if (first == std::string::npos || std::find(kRooms.begin(), kRooms.end(), room) == kRooms.end()) return {};
    const std::size_t second = path.find('/', first + 1);
    const bool has_wing = room == "engine" && second != std::string::npos;
    return {room, has_wing ? path.substr(first + 1, second - first - 1) : ""};
}

/// Comments and string literals blanked, line breaks and include lines kept.
inline std::string strip_comments_and_strings(const std::string& text) {
    std::string out;
    bool line_comment = false, block_comment = false, include_line = false;
    char quote = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : '\0';
        if (c == '\n') line_comment = include_line = false, quote = 0;
        if (!line_comment && !block_comment && quote == 0) {
            if (c == '#') include_line = text.compare(i, 8, "#include") == 0;
            if (c == '/' && next == '/') line_comment = true;
            if (c == '/' && next == '*') block_comment = true, ++i;
            // a quote after a digit separates digits
            const bool separator = c == '\'' && i > 0 && std::isxdigit(static_cast<unsigned char>(text[i - 1])) != 0;
            if ((c == '"' || c == '\'') && !include_line && !separator) {
                quote = c;
                out += c;
                continue;
            }
            if (!line_comment && !block_comment) out += c;
            continue;
        }
        if (c == '\n') out += c;
        if (quote != 0 && c == '\\')
            ++i;
        else if (quote != 0 && c == quote)
            quote = 0, out += c;
        else if (block_comment && c == '*' && next == '/')
            block_comment = false, ++i;
    }
    return out;
}

inline std::vector<std::string> includes_of(const std::string& stripped) {
    static const std::regex kInclude(R"(#\s*include\s*[<"]([^>"]+)[>"])");
    std::vector<std::string> found;
    for (std::sregex_iterator it(stripped.begin(), stripped.end(), kInclude), end; it != end; ++it) found.push_back((*it)[1]);
    return found;
}

/// What is wrong with this file including that one.
inline std::optional<std::string> complaint_about_include(const std::string& file, const std::string& included) {
    const Place from = place_of(file), to = place_of(included);
    if (to.room.empty() || from.room.empty()) return std::nullopt;
    const auto complaint = [&](const std::string& why) { return file + " includes " + included + ": " + why; };
    if (from.room != to.room && to.room != "base" && from.room != "engine") return complaint(from.room + " may include base only");
    if (to.room == "engine" && from.wing != to.wing && !from.wing.empty()) {
        const auto low = std::find(kWings.begin(), kWings.end(), to.wing), high = std::find(kWings.begin(), kWings.end(), from.wing);
        if (high == kWings.end()) return complaint("engine/" + from.wing + " is no known wing");
        if (low >= high) return complaint("engine/" + from.wing + " lies below engine/" + to.wing);
    }
    if (from.wing == "io" && to.room != "base" && to.wing != "io") return complaint("engine/io may include base only");
    return std::nullopt;
}

/// First use of what a file's place forbids in its text.
inline std::optional<std::string> complaint_about_text(const std::string& file, const std::string& stripped) {
    const Place place = place_of(file);
    const auto find = [&](const char* pattern, const char* why) -> std::optional<std::string> {
        std::smatch match;
        if (!std::regex_search(stripped, match, std::regex(pattern))) return std::nullopt;
        const auto line = std::count(stripped.begin(), stripped.begin() + match.position(), '\n') + 1;
        return file + ":" + std::to_string(line) + " uses " + match.str() + ": " + why;
    };
    if (place.wing != "time")
        if (const auto clock = find(R"(\b(\w+_clock\b|clock_gettime|gettimeofday|timespec_get|__rdtsc|std::time\s*\(|std::clock\s*\())",
                                    "only engine/time reads a clock"))
            return clock;
    if (place.room == "engine") return std::nullopt;
    // generators in assets run once and may look things up in hash tables; what runs in the step loop may not
    if (place.room != "assets")
        if (const auto order = find(R"(\bunordered_(map|set|multimap|multiset)\b|\bstd::hash\b|\bthread_local\b|\bthis_thread\b)",
                                    "results of a step may not depend on hashes or threads"))
            return order;
    if (place.room == "base")
        return find(R"(#\s*include\s*<(fstream|iostream|filesystem|cstdio|stdio\.h|chrono|ctime|time\.h|unistd\.h)>)",
                    "base has no input, no output and no clock");
    return std::nullopt;
}

} // namespace trocar::house
