#include "engine/io/file_bytes.hpp"
#include "engine/experiments/regression.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kMostSteps = 1'000'000;
constexpr double kLargestTolerance = 0.1; // m
constexpr const char* kRight = "expected \"scene.json 100 1e-9\": scene, steps, tolerance in metres, and perhaps a budget";

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    while (true) {
        const std::size_t begin = line.find_first_not_of(" \t\r");
        if (begin == std::string_view::npos || line[begin] == '#') return words;
        const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
        words.push_back(line.substr(begin, end - begin));
        line.remove_prefix(end);
    }
}

template <class Number>
bool read_number(std::string_view text, Number& value) {
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    return problem == std::errc() && end == text.data() + text.size();
}

/// Without its ending, and as a reference holds it: names of files may hold any bytes, JSON is UTF-8.
std::string name_of(const std::filesystem::path& scene) {
    const nlohmann::json stem = scene.stem().string();
    return nlohmann::json::parse(stem.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)).get<std::string>();
}

/// What is wrong with the line; empty when all is well.
std::string read_line(const std::vector<std::string_view>& words, const std::filesystem::path& folder, RegressionEntry& entry) {
    if (words.size() < 3 || words.size() > 4) return fmt::format("found {} words; {}", words.size(), kRight);
    if (!read_number(words[1], entry.steps) || entry.steps == 0 || entry.steps > kMostSteps)
        return fmt::format("\"{:.40}\" is no number of steps, 1 to {}; {}", words[1], kMostSteps, kRight);
    if (!read_number(words[2], entry.tolerance) || !(entry.tolerance >= 0.0) || entry.tolerance > kLargestTolerance)
        return fmt::format("\"{:.40}\" is no tolerance, 0 to {} m; {}", words[2], kLargestTolerance, kRight);
    const auto budget = parse_budget(words.size() == 4 ? words[3] : "work:1000000");
    if (!budget.ok()) return budget.error().message;
    if (budget->limits.mode == BudgetMode::Wall)
        return fmt::format("\"{:.40}\" depends on the machine; expected work:20000 or exact", words[3]);
    entry.budget = budget->limits;
    entry.scene = folder / words[0];
    std::error_code failed;
    if (!std::filesystem::is_regular_file(entry.scene, failed))
        return fmt::format("the scene {} is not there", entry.scene.lexically_normal().string());
    entry.name = name_of(entry.scene);
    entry.reference = folder / "references" / (entry.name + ".json.gz");
    return {};
}

} // namespace

Result<std::vector<RegressionEntry>> read_regression_list(const std::filesystem::path& list) {
    const auto text = read_file_bytes(list);
    if (!text.ok()) return text.error();
    std::vector<RegressionEntry> entries;
    std::size_t number = 0;
    for (std::size_t begin = 0; begin < text->size();) {
        const std::size_t end = std::min(text->find('\n', begin), text->size());
        const auto words = words_of(std::string_view(*text).substr(begin, end - begin));
        begin = end + 1;
        ++number;
        if (words.empty()) continue;
        RegressionEntry entry;
        entry.line = number;
        std::string problem = read_line(words, list.parent_path(), entry);
        for (const RegressionEntry& known : entries)
            if (problem.empty() && known.name == entry.name)
                problem = fmt::format("line {} has a scene called {} as well: their references would be one file", known.line, entry.name);
        if (!problem.empty()) return Error{ErrorCode::BadValue, problem, list.string(), number};
        entries.push_back(std::move(entry));
    }
    if (entries.empty()) return Error{ErrorCode::BadValue, fmt::format("no scene in this list; {}", kRight), list.string()};
    return entries;
}

} // namespace trocar::engine
