// Paths of instruments: rows in the scene, or a CSV file that moves one instrument or several.
#include "engine/io/path_csv.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar::engine {
namespace {

struct RowProblem {
    std::size_t row;
    std::size_t column; // 0 the time, 1 the insertion, 2 the rotation
    std::string message;
};

/// Drive speed needed from one row to the next, against its limit.
std::optional<std::string> check_speed(double from, double to, double dt, double limit, std::string_view what, std::string_view key,
                                       Dimension distance, Dimension speed, const Units& units) {
    const double needed = std::abs(to - from) / dt;
    if (needed <= limit * (1.0 + kLimitTolerance)) return std::nullopt;
    return fmt::format("{} from {} to {} within {} needs {}, beyond the limit of {}; expected more time, or "
                       "\"limits\": {{\"{}\": {:.4g}}} in the instrument",
                       what, with_unit(from, distance, units), with_unit(to, distance, units), with_unit(dt, Dimension::Time, units),
                       with_unit(needed, speed, units), with_unit(limit, speed, units), key, needed / units.factor(speed));
}

std::optional<RowProblem> check_row(const PathPoint* before, const PathPoint& row, const SceneInstrument& instrument, const Units& units) {
    if (row.time < 0.0)
        return RowProblem{0, 0, fmt::format("found the time {}; expected 0 or more", with_unit(row.time, Dimension::Time, units))};
    if (row.insertion < 0.0 || row.insertion > instrument.design.length)
        return RowProblem{0, 1,
                          fmt::format("found the insertion {}; expected 0 to the instrument's length, {}",
                                      with_unit(row.insertion, Dimension::Length, units),
                                      with_unit(instrument.design.length, Dimension::Length, units))};
    if (before == nullptr) return std::nullopt;
    const double dt = row.time - before->time;
    if (!(dt > 0.0))
        return RowProblem{0, 0,
                          fmt::format("found the time {} after {}; expected increasing times", with_unit(row.time, Dimension::Time, units),
                                      with_unit(before->time, Dimension::Time, units))};
    if (auto text = check_speed(before->insertion, row.insertion, dt, instrument.limits.speed, "insertion", "speed", Dimension::Length,
                                Dimension::Speed, units))
        return RowProblem{0, 1, *text};
    if (auto text = check_speed(before->rotation, row.rotation, dt, instrument.limits.rotation, "rotation", "rotation", Dimension::Angle,
                                Dimension::AngularSpeed, units))
        return RowProblem{0, 2, *text};
    return std::nullopt;
}

std::optional<RowProblem> check_path(const std::vector<PathPoint>& path, const SceneInstrument& instrument, const Units& units) {
    for (std::size_t i = 0; i < path.size(); ++i)
        if (auto problem = check_row(i > 0 ? &path[i - 1] : nullptr, path[i], instrument, units)) {
            problem->row = i;
            problem->message = fmt::format("row {}: {}", i + 1, problem->message);
            return problem;
        }
    return std::nullopt;
}

/// Rows of a file as this instrument's path.
Result<std::vector<PathPoint>> take_rows(const Units& units, const SceneInstrument& instrument, const std::vector<PathRow>& rows,
                                         const std::filesystem::path& csv) {
    std::vector<PathPoint> path;
    for (const PathRow& row : rows) path.push_back({row.time * units.time, row.insertion * units.length, row.rotation * units.angle});
    if (auto problem = check_path(path, instrument, units)) {
        const PathRow& row = rows[problem->row];
        return Error{ErrorCode::BadValue,
                     problem->message,
                     csv.string(),
                     row.line,
                     row.column[problem->column],
                     fmt::format("instruments.{}.path", instrument.name)};
    }
    return path;
}

/// The instrument's own columns, or all that a file without names holds.
Result<std::vector<PathPoint>> read_csv(const Units& units, const SceneInstrument& instrument, const std::filesystem::path& csv) {
    const auto paths = read_path_table(csv);
    if (!paths) return paths.error();
    std::vector<std::string_view> known;
    for (const NamedPath& path : *paths) {
        if (path.instrument.empty() || path.instrument == instrument.name) return take_rows(units, instrument, path.rows, csv);
        known.push_back(path.instrument);
    }
    return Error{
        ErrorCode::BadValue,
        fmt::format("holds no column {0}.insertion; {1}", instrument.name, suggest("instrument of the file", instrument.name, known)),
        csv.string(),
        paths->front().line,
        paths->front().column,
        fmt::format("instruments.{}.path", instrument.name)};
}

} // namespace

std::optional<Error> read_path(const CheckContext& context, const Values& values, SceneInstrument& instrument) {
    const JsonNode& node = *values.find("path");
    if (node.type == JsonType::Text) {
        const auto file = resolve_file(node.text, context.folder);
        if (!file) return fail_at(context, values, "path", file.error().message, file.error().code);
        auto path = read_csv(context.units, instrument, *file);
        if (!path) return path.error();
        instrument.path = std::move(path).value();
        instrument.path_file = *file;
        return std::nullopt;
    }
    for (const JsonNode& row : node.children)
        instrument.path.push_back({values.column("path", row, 0), values.column("path", row, 1), values.column("path", row, 2)});
    const auto problem = check_path(instrument.path, instrument, context.units);
    if (!problem) return std::nullopt;
    return error_at(context, node.children[problem->row].at, fmt::format("{}[{}]", values.path("path"), problem->row), problem->message);
}

Result<void> read_instrument_paths(Scene& scene, const std::filesystem::path& csv) {
    const auto paths = read_path_table(csv);
    if (!paths) return paths.error();
    std::vector<std::string_view> known;
    for (const SceneInstrument& instrument : scene.instruments) known.push_back(instrument.name);
    for (const NamedPath& path : *paths) {
        const auto named = path.instrument.empty()
                               ? scene.instruments.begin()
                               : std::find(known.begin(), known.end(), path.instrument) - known.begin() + scene.instruments.begin();
        if (named == scene.instruments.end())
            return Error{ErrorCode::BadValue, refuse_unknown("instrument", path.instrument, known), csv.string(), path.line, path.column};
        auto rows = take_rows(scene.units, *named, path.rows, csv);
        if (!rows) return rows.error();
        named->path = std::move(rows).value();
        named->path_file = csv; // what it followed stays: the report measures the tip against that target
    }
    return {};
}

/// Columns of instruments that the scene does not have, or does not move by that file, are a mistake.
std::optional<Error> check_path_files(const Scene& scene) {
    for (const SceneInstrument& instrument : scene.instruments) {
        if (instrument.path_file.empty()) continue;
        const auto paths = read_path_table(instrument.path_file);
        if (!paths) return paths.error();
        for (const NamedPath& path : *paths) {
            if (path.instrument.empty()) continue;
            std::vector<std::string_view> known;
            bool moved = false;
            for (const SceneInstrument& other : scene.instruments) {
                known.push_back(other.name);
                moved |= other.name == path.instrument && other.path_file == instrument.path_file;
            }
            if (moved) continue;
            const bool exists = std::find(known.begin(), known.end(), path.instrument) != known.end();
            return Error{
                ErrorCode::BadValue,
                exists ? fmt::format("found columns of {0}, which this file does not move; expected them left out, or the same \"path\" "
                                     "in that instrument",
                                     path.instrument)
                       : refuse_unknown("instrument", path.instrument, known),
                instrument.path_file.string(), path.line, path.column};
        }
    }
    return std::nullopt;
}

} // namespace trocar::engine
