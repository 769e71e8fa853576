#include "engine/importing/curve_set.hpp"
#include "engine/importing/folder_files.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/read_surface.hpp"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <algorithm>
#include <cmath>
#include <map>

namespace trocar::engine {

namespace {

namespace fs = std::filesystem;

constexpr double kCentimetre = 1e-2;            // m
constexpr std::ptrdiff_t kMostXmlTags = 2'000'000; // a path of ten thousand points has some twenty thousand

/// SimVascular writes more than one top element into a file; what stands before the wanted one does not matter.
Result<void> load_xml(const fs::path& file, pugi::xml_document& document) {
    const Result<std::string> bytes = read_file_bytes(file);
    if (!bytes.ok()) return bytes.error();
    if (std::count(bytes->begin(), bytes->end(), '<') > kMostXmlTags) return Error{ErrorCode::BadSyntax, "has too many tags for a path", file.string()};
    const pugi::xml_parse_result parsed = document.load_buffer(bytes->data(), bytes->size());
    if (parsed) return {};
    const auto at = std::min<std::ptrdiff_t>(parsed.offset, static_cast<std::ptrdiff_t>(bytes->size()));
    return Error{ErrorCode::BadSyntax, fmt::format("is no well-formed XML: {}", parsed.description()), file.string(),
                 1 + static_cast<std::size_t>(std::count(bytes->begin(), bytes->begin() + at, '\n'))};
}

bool read_vector(const pugi::xml_node& node, Vec3& p) {
    for (int axis = 0; axis < 3; ++axis) {
        static constexpr const char* kAxes[] = {"x", "y", "z"};
        const pugi::xml_attribute attribute = node.attribute(kAxes[axis]);
        char* end = nullptr;
        const char* text = attribute.value();
        p[axis] = std::strtod(text, &end);
        if (!attribute || end == text || *end != '\0' || !(std::abs(p[axis]) < 1e6)) return false;
    }
    return true;
}

Error bad_place(const fs::path& file, const char* key) {
    return {ErrorCode::BadValue, "expected three finite numbers x, y and z, in cm", file.string(), 0, 0, key};
}

Result<NamedCurve> read_path(const fs::path& file) {
    pugi::xml_document document;
    if (const Result<void> loaded = load_xml(file, document); !loaded.ok()) return loaded.error();
    NamedCurve curve{file.stem().string(), {}, {}};
    const pugi::xml_node points = document.select_node("//path_points").node();
    for (const pugi::xml_node point : points.children("path_point")) {
        Vec3 p;
        if (!read_vector(point.child("pos"), p)) return bad_place(file, "path_point.pos");
        curve.points.push_back(kCentimetre * p);
    }
    if (curve.points.size() < 2)
        return Error{ErrorCode::BadValue, fmt::format("has {} path points; expected two or more", curve.points.size()), file.string(), 0, 0, "path_points"};
    return curve;
}

struct Contour {
    Vec3 centre;   // m
    double radius; // m
};

Result<std::vector<Contour>> read_contours(const fs::path& file, std::string& path_name) {
    pugi::xml_document document;
    if (const Result<void> loaded = load_xml(file, document); !loaded.ok()) return loaded.error();
    path_name = document.select_node("//contourgroup").node().attribute("path_name").value();
    std::vector<Contour> contours;
    for (const pugi::xpath_node found : document.select_nodes("//contour")) {
        std::vector<Vec3> points;
        for (const pugi::xml_node point : found.node().child("contour_points").children("point")) {
            Vec3 p;
            if (!read_vector(point, p)) return bad_place(file, "contour_points.point");
            points.emplace_back(kCentimetre * p);
        }
        if (points.size() < 3) continue;
        Contour contour{Vec3::Zero(), 0.0};
        for (const Vec3& p : points) contour.centre += p / static_cast<double>(points.size());
        for (const Vec3& p : points) contour.radius += (p - contour.centre).norm() / static_cast<double>(points.size());
        if (contour.radius > 0.0) contours.push_back(contour);
    }
    return contours;
}

/// The first contour's radius before it, the last one's behind it, linear between.
void spread(NamedCurve& curve, const std::vector<Contour>& contours) {
    std::map<std::size_t, double> known;
    for (const Contour& contour : contours) {
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < curve.points.size(); ++i)
            if ((curve.points[i] - contour.centre).squaredNorm() < (curve.points[nearest] - contour.centre).squaredNorm()) nearest = i;
        known[nearest] = contour.radius;
    }
    for (std::size_t i = 0; i < curve.points.size(); ++i) {
        const auto after = known.lower_bound(i);
        if (after == known.end()) {
            curve.radii.push_back(known.rbegin()->second);
        } else if (after->first == i || after == known.begin()) {
            curve.radii.push_back(after->second);
        } else {
            const auto before = std::prev(after);
            const double t = static_cast<double>(i - before->first) / static_cast<double>(after->first - before->first);
            curve.radii.push_back((1 - t) * before->second + t * after->second);
        }
    }
}

} // namespace

Result<CurveSet> read_simvascular(const fs::path& path) {
    std::error_code failed;
    if (!fs::is_directory(path, failed)) return Error{ErrorCode::FileNotFound, "is no folder; expected a SimVascular project", path.string()};
    CurveSet set;
    set.facts.emplace_back("unit", "cm, as SimVascular's projects have");
    if (const auto models = list_files(path / "Models", ".vtp"); models.ok()) {
        ReadOptions reading;
        reading.weld = true;
        Result<TriMesh> mesh = read_surface(models->front(), reading);
        if (!mesh.ok()) return mesh.error();
        for (Vec3& v : mesh->vertices) v *= kCentimetre;
        set.facts.emplace_back("surface", fmt::format("{}{}", models->front().filename().string(),
                                                      models->size() > 1 ? fmt::format(", the first of {} models", models->size()) : std::string()));
        set.surface = std::move(*mesh);
        set.files = {models->front()};
        return set;
    }
    const auto paths = list_files(path / "Paths", ".pth");
    if (!paths.ok()) return paths.error();
    const auto groups = list_files(path / "Segmentations", ".ctgr");
    if (!groups.ok())
        return Error{ErrorCode::BadValue, "has paths, and neither Models/*.vtp nor Segmentations/*.ctgr that say how wide they are", path.string()};
    set.files = *paths;
    set.files.insert(set.files.end(), groups->begin(), groups->end());
    std::map<std::string, std::vector<Contour>> contours;
    for (const fs::path& file : *groups) {
        std::string name;
        Result<std::vector<Contour>> read = read_contours(file, name);
        if (!read.ok()) return read.error();
        contours[name.empty() ? file.stem().string() : name] = std::move(*read);
    }
    std::size_t without = 0;
    for (const fs::path& file : *paths) {
        Result<NamedCurve> curve = read_path(file);
        if (!curve.ok()) return curve.error();
        const auto found = contours.find(curve->name);
        if (found == contours.end() || found->second.empty()) {
            ++without;
            continue;
        }
        spread(*curve, found->second);
        set.curves.push_back(std::move(*curve));
    }
    if (set.curves.empty()) return Error{ErrorCode::BadValue, "no path has a segmentation with contours, which say how wide it is", path.string()};
    set.facts.emplace_back("paths", fmt::format("{} with contours, {} without passed over", set.curves.size(), without));
    return set;
}

} // namespace trocar::engine
