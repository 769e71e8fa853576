#include "engine/io/markups.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace trocar::engine {
namespace {

using Json = nlohmann::json;

constexpr double kFarthest = 1e9; // m, of a position: beyond it nothing is anatomy
/// JSON deeper than Slicer writes it: a hostile file.
constexpr std::size_t kDeepest = 64;

Result<Json> parse_json(const std::string& bytes, const std::string& name) {
    std::size_t depth = 0, line = 1;
    bool quoted = false;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        const char c = bytes[i];
        if (c == '\n') ++line;
        if (quoted && c == '\\')
            ++i;
        else if (c == '"')
            quoted = !quoted;
        else if (!quoted && (c == '[' || c == '{') && ++depth > kDeepest)
            return Error{ErrorCode::BadSyntax, fmt::format("is nested deeper than {}: not a Markups file", kDeepest), name, line};
        else if (!quoted && (c == ']' || c == '}') && depth > 0)
            --depth;
    }
    try {
        return Json::parse(bytes);
    } catch (const Json::parse_error& error) {
        const std::size_t at = std::min<std::size_t>(error.byte, bytes.size());
        const auto broken = 1 + static_cast<std::size_t>(std::count(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
        return Error{ErrorCode::BadSyntax, fmt::format("is no well-formed JSON near byte {}", error.byte), name, broken};
    } catch (const Json::out_of_range&) {
        return Error{ErrorCode::BadValue, "holds a number that is too large for any", name};
    }
}

class MarkupReader {
public:
    explicit MarkupReader(std::string name) : name_(std::move(name)) {}

    Result<std::vector<Markup>> read(const Json& file) {
        if (!file.is_object() || !file.contains("markups") || !file["markups"].is_array())
            return bad("markups", "is no Markups file: the list \"markups\" is missing");
        std::vector<Markup> markups;
        for (std::size_t m = 0; m < file["markups"].size(); ++m) {
            Result<Markup> markup = read_one(file["markups"][m], fmt::format("markups[{}]", m));
            if (!markup.ok()) return markup.error();
            markups.push_back(std::move(*markup));
        }
        if (markups.empty()) return bad("markups", "holds no markup");
        return markups;
    }

private:
    Error bad(std::string key, std::string message) const {
        return {ErrorCode::BadValue, std::move(message), name_, 0, 0, std::move(key)};
    }

    static std::string text_of(const Json& object, const char* key, const char* otherwise) {
        return object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : otherwise;
    }

    Result<double> unit_of(const Json& json, const std::string& key) const {
        const std::string unit = text_of(json, "coordinateUnits", "mm");
        for (const auto& [name, metres] : {std::pair{"mm", 1e-3}, {"m", 1.0}, {"cm", 1e-2}, {"um", 1e-6}})
            if (unit == name) return metres;
        return bad(key + ".coordinateUnits", fmt::format("found '{}'; expected mm, cm, m or um", unit));
    }

    /// +1 or -1 of x and y: LPS, which a file that says none is in, is turned into RAS. Old files write 0 (RAS) or 1 (LPS).
    Result<double> turn_of(const Json& json, const std::string& key) const {
        if (!json.contains("coordinateSystem")) return -1.0;
        const Json& system = json["coordinateSystem"];
        if (system == "LPS" || system == "1" || system == 1) return -1.0;
        if (system == "RAS" || system == "0" || system == 0) return 1.0;
        return bad(key + ".coordinateSystem", "expected LPS or RAS");
    }

    Result<Vec3> position_of(const Json& point, const std::string& key, double unit, double turn) const {
        const Json position = point.is_object() && point.contains("position") ? point["position"] : Json();
        if (!position.is_array() || position.size() != 3 ||
            !std::all_of(position.begin(), position.end(), [](const Json& number) { return number.is_number(); }))
            return bad(key + ".position", "expected three numbers");
        const Vec3 p(turn * unit * position[0].get<double>(), turn * unit * position[1].get<double>(), unit * position[2].get<double>());
        if (!is_finite(p) || !(p.cwiseAbs().maxCoeff() < kFarthest)) return bad(key + ".position", "expected three finite numbers");
        return p;
    }

    /// Values of the measurement Radius, one per control point; empty: there is none.
    Result<std::vector<double>> radii_of(const Json& json, const std::string& key, std::size_t count, double unit) const {
        std::vector<double> radii;
        if (!json.contains("measurements") || !json["measurements"].is_array()) return radii;
        for (std::size_t m = 0; m < json["measurements"].size(); ++m) {
            const Json& measurement = json["measurements"][m];
            if (!measurement.is_object() || text_of(measurement, "name", "") != "Radius" || !measurement.contains("controlPointValues")) continue;
            const Json& values = measurement["controlPointValues"];
            const std::string where = fmt::format("{}.measurements[{}].controlPointValues", key, m);
            if (!values.is_array() || values.size() != count)
                return bad(where, fmt::format("expected {} numbers, one for each control point", count));
            for (const Json& value : values) {
                const double radius = value.is_number() ? unit * value.get<double>() : -1.0;
                if (!(radius >= 0.0) || !(radius < kFarthest)) return bad(where, "expected radii that are not negative");
                radii.push_back(radius);
            }
        }
        return radii;
    }

    Result<Markup> read_one(const Json& json, const std::string& key) {
        if (!json.is_object()) return bad(key, "expected an object");
        const auto unit = unit_of(json, key);
        if (!unit.ok()) return unit.error();
        const auto turn = turn_of(json, key);
        if (!turn.ok()) return turn.error();
        Markup markup;
        markup.type = text_of(json, "type", "Fiducial");
        markup.name = text_of(json, "name", "");
        if (!json.contains("controlPoints") || !json["controlPoints"].is_array()) return bad(key + ".controlPoints", "expected a list");
        const Json& points = json["controlPoints"];
        seen_ += points.size();
        if (seen_ > kMostMarkupPoints) return bad(key + ".controlPoints", fmt::format("more than {} points in all", kMostMarkupPoints));
        auto radii = radii_of(json, key, points.size(), *unit);
        if (!radii.ok()) return radii.error();
        for (std::size_t i = 0; i < points.size(); ++i) { // their ids may stand twice: Slicer leaves them so where it joins curves
            if (points[i].is_object() && text_of(points[i], "positionStatus", "defined") != "defined") continue;
            const auto p = position_of(points[i], fmt::format("{}.controlPoints[{}]", key, i), *unit, *turn);
            if (!p.ok()) return p.error();
            markup.points.push_back(*p);
            markup.labels.push_back(text_of(points[i], "label", ""));
            if (!radii->empty()) markup.radii.push_back((*radii)[i]);
        }
        return markup;
    }

    std::string name_;
    std::size_t seen_ = 0;
};

/// JSON's own escapes.
std::string quoted(const std::string& text) { return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string markup_text(const Markup& markup) {
    std::string text = fmt::format("        {{\n            \"type\": {},\n            \"coordinateSystem\": \"RAS\",\n            "
                                   "\"coordinateUnits\": \"mm\",\n",
                                   quoted(markup.type));
    if (!markup.name.empty()) text += fmt::format("            \"name\": {},\n", quoted(markup.name));
    text += "            \"controlPoints\": [\n";
    for (std::size_t i = 0; i < markup.points.size(); ++i) {
        const Vec3 p = 1e3 * markup.points[i];
        const std::string label = i < markup.labels.size() && !markup.labels[i].empty() ? markup.labels[i] : std::to_string(i + 1);
        text += fmt::format("                {{\"id\": \"{}\", \"label\": {}, \"position\": [{}, {}, {}], \"positionStatus\": \"defined\"}}{}\n",
                            i + 1, quoted(label), p.x(), p.y(), p.z(), i + 1 < markup.points.size() ? "," : "");
    }
    text += "            ]";
    if (!markup.radii.empty()) {
        text += ",\n            \"measurements\": [{\"name\": \"Radius\", \"enabled\": true, \"units\": \"mm\", \"controlPointValues\": [";
        for (std::size_t i = 0; i < markup.radii.size(); ++i) text += fmt::format("{}{}", i > 0 ? ", " : "", 1e3 * markup.radii[i]);
        text += "]}]";
    }
    return text + "\n        }";
}

} // namespace

Result<std::vector<Markup>> read_markups(const std::filesystem::path& path) {
    const Result<std::string> bytes = read_file_bytes(path);
    if (!bytes.ok()) return bytes.error();
    const Result<Json> json = parse_json(*bytes, path.string());
    if (!json.ok()) return json.error();
    return MarkupReader(path.string()).read(*json);
}

Result<void> write_markups(const std::filesystem::path& path, std::span<const Markup> markups) {
    std::string text = "{\n    \"@schema\": \"https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
                       "markups-schema-v1.0.3.json#\",\n    \"markups\": [\n";
    for (std::size_t m = 0; m < markups.size(); ++m) text += markup_text(markups[m]) + (m + 1 < markups.size() ? ",\n" : "\n");
    return write_file_atomically(path, text + "    ]\n}\n");
}

} // namespace trocar::engine
