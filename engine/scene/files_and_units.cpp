// The parts of the check that look outside the tree: declared units, names of files.
#include "engine/scene/check.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace trocar::engine {
namespace {

constexpr std::string_view kVariable = "TROCAR_TEST_DATA";

/// Replaces "${TROCAR_TEST_DATA}" wherever it stands.
Result<std::string> expand(std::string_view name) {
    std::string text;
    for (std::size_t start = 0;;) {
        const std::size_t open = name.find("${", start);
        text += name.substr(start, open - start);
        if (open == std::string_view::npos) return text;
        const std::size_t close = name.find('}', open);
        const std::string_view variable = name.substr(open + 2, close == std::string_view::npos ? close : close - open - 2);
        if (close == std::string_view::npos || variable != kVariable)
            return Error{ErrorCode::BadValue,
                         fmt::format("found the variable \"{:.60}\" in a file name; ${{{}}} is the only one known", variable, kVariable)};
        const char* folder = std::getenv(kVariable.data());
        if (folder == nullptr || *folder == '\0')
            return Error{
                ErrorCode::FileNotFound,
                fmt::format("needs the environment variable {}, which is not set; expected the folder of the test data", kVariable)};
        text += folder;
        start = close + 1;
    }
}

double* unit_factor(Units& units, std::string_view key) {
    if (key == "length") return &units.length;
    if (key == "time") return &units.time;
    if (key == "angle") return &units.angle;
    if (key == "pressure") return &units.pressure;
    return key == "density" ? &units.density : &units.force;
}

std::string* unit_name(Units& units, std::string_view key) {
    if (key == "length") return &units.length_name;
    if (key == "time") return &units.time_name;
    if (key == "angle") return &units.angle_name;
    if (key == "pressure") return &units.pressure_name;
    return key == "density" ? &units.density_name : &units.force_name;
}

} // namespace

Result<std::filesystem::path> resolve_file(std::string_view name, const std::filesystem::path& folder) {
    if (name.find('\0') != std::string_view::npos) return Error{ErrorCode::BadValue, "found a zero byte in a file name"};
    const auto expanded = expand(name);
    if (!expanded) return expanded.error();
    const std::filesystem::path file = (folder / *expanded).lexically_normal();
    std::error_code problem;
    const auto status = std::filesystem::status(file, problem);
    if (std::filesystem::is_regular_file(status)) return file;
    const char* what = std::filesystem::is_directory(status) ? "is a folder"
                       : std::filesystem::exists(status)     ? "is no regular file"
                                                             : "does not exist";
    return Error{ErrorCode::FileNotFound,
                 fmt::format("the file \"{:.200}\" {} (looked for {:.300}); expected a file relative to the scene's folder", name, what,
                             file.string())};
}

std::optional<Error> read_units(const JsonNode& root, const ObjectSpec& spec, CheckContext& context) {
    const JsonNode* node = root.find("units");
    if (node == nullptr) return std::nullopt; // the check of the whole object says so
    if (auto error = check_object(*node, spec, "units", context)) return error;
    for (const JsonNode& member : node->children) {
        *unit_name(context.units, member.key) = member.text;
        *unit_factor(context.units, member.key) = *find_unit(spec.find(member.key)->value.dimension, member.text);
    }
    return std::nullopt;
}

} // namespace trocar::engine
