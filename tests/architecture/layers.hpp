// The architecture as rules over text: which folder may include which, that nothing includes itself by a detour, and what the
// text of a folder may not use.
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::layers {

/// Top-level folders that hold sources of the product.
inline constexpr std::array<std::string_view, 8> kModules{"base", "fem", "spheretree", "collision", "assets", "engine", "bench", "python"};

struct Folder {
    std::string_view name;
    int layer; // a folder may include every folder of a lower layer
    int order; // and, of its own layer, those of its own module with a lower order
};

/// All folders with sources, lowest layer first. fem, spheretree and collision share a layer: they never include one another.
inline constexpr std::array kFolders{
    Folder{"base", 0, 0},
    Folder{"assets/anatomy", 1, 0},
    Folder{"engine/io", 1, 0},
    Folder{"engine/time", 1, 0},
    Folder{"fem/mesh", 1, 0},
    Folder{"fem/tissue", 1, 1},
    Folder{"fem/embedding", 1, 2},
    Folder{"fem/rod", 1, 2},
    Folder{"spheretree", 1, 0},
    Folder{"spheretree/build", 1, 1},
    Folder{"spheretree/update", 1, 1},
    Folder{"spheretree/lumen", 1, 2},
    Folder{"spheretree/traverse", 1, 3},
    Folder{"collision", 1, 0},
    Folder{"collision/ccd", 1, 1},
    Folder{"collision/bvh", 1, 2},
    Folder{"collision/culling", 1, 3},
    Folder{"collision/proximity", 1, 4},
    Folder{"collision/search", 1, 4},
    Folder{"engine/scene", 2, 0},
    Folder{"engine/prepare", 3, 0},
    Folder{"engine/state", 3, 1},
    Folder{"engine/importing", 3, 1},
    Folder{"engine/effects", 3, 1},
    Folder{"engine/effects/elasticity", 3, 2},
    Folder{"engine/effects/damping", 3, 2},
    Folder{"engine/effects/gravity", 3, 2},
    Folder{"engine/effects/breathing", 3, 2},
    Folder{"engine/effects/pulse", 3, 2},
    Folder{"engine/effects/coarse_contact", 3, 2},
    Folder{"engine/effects/self_contact", 3, 2},
    Folder{"engine/effects/instrument_contact", 3, 2},
    Folder{"engine/effects/exact_contact", 3, 2},
    Folder{"engine/effects/friction", 3, 2},
    Folder{"engine/effects/twist", 3, 2},
    Folder{"engine/effects/blood_drag", 3, 2},
    Folder{"engine/effects/loads", 3, 2},
    Folder{"engine/effects/contrast", 3, 2},
    Folder{"engine/effects/fluoroscopy", 3, 2},
    Folder{"engine/step/contact", 4, 0},
    Folder{"engine/step/tissue", 4, 1},
    Folder{"engine/step/solid", 4, 2},
    Folder{"engine/step/instrument", 4, 2},
    Folder{"engine/step", 4, 3},
    Folder{"engine", 4, 4}, // trocar.hpp, which users include
    Folder{"engine/c_api", 4, 4},
    Folder{"engine/fluoroscopy", 5, 0},
    Folder{"engine/render", 5, 0},
    Folder{"engine/report", 6, 0},
    Folder{"engine/experiments", 7, 0},
    Folder{"engine/experiments/sweep", 7, 1},
    Folder{"engine/episodes", 7, 1},
    Folder{"engine/viewer", 8, 0},
    Folder{"engine/igtl", 8, 1},
    Folder{"python/binding", 8, 0},
    Folder{"engine/cli", 9, 0},
    Folder{"bench", 9, 0},
    Folder{"bench/whole_steps", 9, 1},
    Folder{"bench/program", 10, 0},
};

/// Files, without their endings, that still include one another in a circle. One that does no longer must leave this list.
inline constexpr std::array<std::string_view, 0> kKnownCycle{};

[[nodiscard]] inline std::string folder_of(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    return slash == std::string::npos ? "" : path.substr(0, slash);
}

[[nodiscard]] inline std::string module_of(const std::string& path) { return path.substr(0, path.find('/')); }

/// A header and its source are one unit: the path without its ending.
[[nodiscard]] inline std::string stem_of(const std::string& path) { return path.substr(0, path.rfind('.')); }

[[nodiscard]] inline const Folder* find_folder(const std::string& name) {
    const auto found = std::find_if(kFolders.begin(), kFolders.end(), [&](const Folder& folder) { return folder.name == name; });
    return found == kFolders.end() ? nullptr : &*found;
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

/// Includes in quotes: those of the product. Others are in angle brackets.
inline std::vector<std::string> includes_of(const std::string& stripped) {
    static const std::regex kInclude(R"re(#\s*include\s*"([^"]+)")re");
    std::vector<std::string> found;
    for (std::sregex_iterator it(stripped.begin(), stripped.end(), kInclude), end; it != end; ++it) found.push_back((*it)[1]);
    return found;
}

/// What is wrong with this file including that one.
inline std::optional<std::string> complaint_about_include(const std::string& file, const std::string& included) {
    const auto complaint = [&](const std::string& why) { return file + " includes " + included + ": " + why; };
    const Folder *from = find_folder(folder_of(file)), *to = find_folder(folder_of(included));
    if (from == nullptr) return file + " lies in a folder that layers.hpp does not list";
    if (to == nullptr) return complaint("expected a path from the top of the sources, into a folder that layers.hpp lists");
    if (from == to || to->layer < from->layer) return std::nullopt;
    if (to->layer > from->layer) return complaint(std::string(from->name) + " lies below " + std::string(to->name));
    if (module_of(file) != module_of(included)) return complaint("modules of one layer do not include one another");
    if (to->order >= from->order) return complaint(std::string(to->name) + " does not lie below " + std::string(from->name));
    return std::nullopt;
}

/// Each name and what it includes.
using Graph = std::map<std::string, std::set<std::string>>;

/// Groups of two or more names of which each reaches each other (Tarjan 1972), sorted.
class CycleSearch {
public:
    explicit CycleSearch(const Graph& graph) : graph_(graph) {
        for (const auto& [name, targets] : graph_)
            if (!number_.contains(name)) visit(name);
        std::sort(cycles_.begin(), cycles_.end());
    }
    [[nodiscard]] const std::vector<std::vector<std::string>>& cycles() const noexcept { return cycles_; }

private:
    int visit(const std::string& name) {
        const int number = static_cast<int>(number_.size());
        int low = number_[name] = number;
        open_.push_back(name);
        if (const auto found = graph_.find(name); found != graph_.end())
            for (const std::string& target : found->second) {
                if (!number_.contains(target))
                    low = std::min(low, visit(target));
                else if (std::find(open_.begin(), open_.end(), target) != open_.end())
                    low = std::min(low, number_[target]);
            }
        if (low == number) close(name);
        return low;
    }

    void close(const std::string& name) {
        const auto begin = std::find(open_.begin(), open_.end(), name);
        std::vector<std::string> group(begin, open_.end());
        open_.erase(begin, open_.end());
        std::sort(group.begin(), group.end());
        if (group.size() > 1) cycles_.push_back(std::move(group));
    }

    const Graph& graph_;
    std::map<std::string, int> number_;
    std::vector<std::string> open_;
    std::vector<std::vector<std::string>> cycles_;
};

[[nodiscard]] inline std::vector<std::vector<std::string>> find_cycles(const Graph& graph) { return CycleSearch(graph).cycles(); }

/// What is wrong with the cycles of a graph where some names are known to be in one: every name that is not known, and every known one
/// that is in none.
inline std::vector<std::string> complaints_about_cycles(const Graph& graph, std::vector<std::string> known) {
    std::vector<std::string> complaints;
    for (const std::vector<std::string>& cycle : find_cycles(graph)) {
        std::string names;
        bool all_known = true;
        for (const std::string& name : cycle) {
            names += (names.empty() ? "" : ", ") + name;
            const auto found = std::find(known.begin(), known.end(), name);
            if (found == known.end())
                all_known = false;
            else
                known.erase(found);
        }
        if (!all_known) complaints.push_back("include one another in a circle: " + names);
    }
    for (const std::string& name : known) complaints.push_back(name + " is in no cycle: take it from the list of known ones");
    return complaints;
}

/// First use of what a file's folder forbids in its text.
inline std::optional<std::string> complaint_about_text(const std::string& file, const std::string& stripped) {
    const std::string module = module_of(file);
    const auto find = [&](const char* pattern, const char* why) -> std::optional<std::string> {
        std::smatch match;
        if (!std::regex_search(stripped, match, std::regex(pattern))) return std::nullopt;
        const auto line = std::count(stripped.begin(), stripped.begin() + match.position(), '\n') + 1;
        return file + ":" + std::to_string(line) + " uses " + match.str() + ": " + why;
    };
    if (folder_of(file) != "engine/time")
        if (const auto clock = find(R"(\b(\w+_clock\b|clock_gettime|gettimeofday|timespec_get|__rdtsc|std::time\s*\(|std::clock\s*\())",
                                    "only engine/time reads a clock"))
            return clock;
    if (module == "engine" || module == "bench") return std::nullopt;
    // generators in assets run once and may look things up in hash tables; what runs in the step loop may not
    if (module != "assets")
        if (const auto order = find(R"(\bunordered_(map|set|multimap|multiset)\b|\bstd::hash\b|\bthread_local\b|\bthis_thread\b)",
                                    "results of a step may not depend on hashes or threads"))
            return order;
    if (module == "base")
        return find(R"(#\s*include\s*<(fstream|iostream|filesystem|cstdio|stdio\.h|chrono|ctime|time\.h|unistd\.h)>)",
                    "base has no input, no output and no clock");
    return std::nullopt;
}

} // namespace trocar::layers
