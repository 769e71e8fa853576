#include "engine/scene/read_design.hpp"

#include "assets/anatomy/curves.hpp"
#include "engine/scene/describe_instrument.hpp"
#include "engine/scene/device.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/read_keys.hpp"
#include "engine/scene/recipe.hpp"
#include "engine/scene/scene_table.hpp"
#include "fem/rod/rod_model.hpp"
#include "fem/rod/tip_arcs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar::engine {
namespace {

constexpr double kLeastSegments = 4.0;
constexpr double kPigtailLength = 0.04; // m, when absent
constexpr double kPigtailAngle = 6.0;   // rad, when absent
constexpr double kLargestTipAngle = 20.0; // rad, of what is no pigtail: more is a number of degrees
constexpr double kMostSegments = 20000.0;
constexpr std::size_t kPiecesPerSpan = 16; // of a tip's curve, from point to point
constexpr double kNearestPoints = 1e-5; // m, of a tip's curve
constexpr double kSameRadius = 1e-6; // [-] layers that were written in decimals end at the radius

/// A coil or a curve needs enough nodes: checked here, where units and keys are known.
std::optional<Error> check_corners(const CheckContext& context, const Values& values, const fem::RodDesign& design) {
    const double turn = fem::sharpest_node(design);
    if (turn <= fem::kSharpestNode) return std::nullopt;
    const auto angle_text = [&](double angle) { return with_unit(angle, Dimension::Angle, context.units); };
    if (design.tip == fem::TipShape::Curve)
        return fail_at(context, values, "segment",
                       fmt::format("found {}, at which the tip's curve turns by {} from node to node; expected {} at most: a shorter segment, or a "
                                   "rounder curve",
                                   with_unit(design.segment, Dimension::Length, context.units), angle_text(turn), angle_text(fem::kSharpestNode)));
    const double longest = fem::kSharpestNode * design.tip_length / design.tip_angle;
    return fail_at(
        context, values, "segment",
        fmt::format("found {}, at which the pigtail of {} over {} turns by {} from node to node; expected {} at most, a segment of {} or "
                    "less",
                    with_unit(design.segment, Dimension::Length, context.units), angle_text(design.tip_angle),
                    with_unit(design.tip_length, Dimension::Length, context.units), angle_text(turn), angle_text(fem::kSharpestNode),
                    with_unit(longest, Dimension::Length, context.units)));
}

/// Keys of the tip without use under the shape of the device, which the check of the file does not know.
std::optional<Error> check_tip_keys(const CheckContext& context, const Values& tip, const SceneInstrument& instrument) {
    if (tip.has("shape")) return std::nullopt;
    const ObjectSpec& table = table_of<TipKeys>();
    const ValueSpec& shapes = table.find("shape")->value;
    const std::string_view shape = shapes.choices[shapes.index_of(static_cast<int>(instrument.design.tip))];
    for (const FieldSpec& field : table.fields) {
        const std::vector<std::string_view>& used = field.used_when;
        if (!tip.has(field.key) || used.empty() || std::find(used.begin(), used.end(), shape) != used.end()) continue;
        return fail_at(context, tip, field.key,
                       fmt::format("unused key \"{}\": the tip of the device {} has the shape \"{}\"; the key is used where it is {}; "
                                   "expected it left out, or shape named",
                                   field.key, instrument.device, shape, fmt::join(used, " or ")));
    }
    return std::nullopt;
}

/// What a shape has where nothing is said of it: a pigtail its size, a straight tip and a curve the shaft's stiffness.
void complete_tip(const Values& tip, fem::RodDesign& design) {
    if (design.tip == fem::TipShape::Straight) design.tip_stiffness = 1.0;
    if (!tip.has("shape")) return;
    if (design.tip == fem::TipShape::Pigtail) {
        if (!tip.has("length")) design.tip_length = kPigtailLength;
        if (!tip.has("angle")) design.tip_angle = kPigtailAngle;
    }
    if (design.tip == fem::TipShape::Curve && !tip.has("stiffness")) design.tip_stiffness = 1.0;
}

std::optional<Error> complete_curve(const CheckContext& context, const Values& tip, fem::RodDesign& design) {
    if (design.tip != fem::TipShape::Curve) {
        design.arcs.clear();
        return std::nullopt;
    }
    if (tip.has("arcs") && tip.has("points")) return fail_at(context, tip, "points", "found beside arcs; expected one of them");
    if (design.arcs.empty()) return fail_at(context, tip, "shape", "found a curve that nothing tells; expected \"arcs\" or \"points\" beside it");
    design.tip_length = design.tip_angle = 0.0;
    for (const fem::TipArc& arc : design.arcs) design.tip_length += arc.length, design.tip_angle += std::abs(arc.angle);
    return std::nullopt;
}

/// What is missing or contradicts itself, lengths above all.
std::optional<Error> complete_design(const CheckContext& context, const Values& values, fem::RodDesign& design) {
    const Values tip = values.object("tip");
    if ((design.tip == fem::TipShape::J || design.tip == fem::TipShape::Simmons) && design.tip_angle > kLargestTipAngle)
        return fail_at(context, tip, "angle",
                       fmt::format("found {:g} rad; expected at most {:g} rad, or the shape \"pigtail\"; was it meant in deg?", design.tip_angle, kLargestTipAngle));
    complete_tip(tip, design);
    if (auto error = complete_curve(context, tip, design)) return error;
    const auto length_text = [&](double length) { return with_unit(length, Dimension::Length, context.units); };
    if (design.tip != fem::TipShape::Straight && design.tip_length > design.length)
        return fail_at(context, tip, design.tip == fem::TipShape::Curve ? "shape" : "length",
                       fmt::format("found {}; expected at most the instrument's length, {}", length_text(design.tip_length),
                                   length_text(design.length)));
    const double segments = design.length / design.segment;
    if (segments >= kLeastSegments && segments <= kMostSegments) return check_corners(context, values, design);
    return fail_at(context, values, "segment",
                   fmt::format("found {}, which divides the length of {} into {:.0f}; expected {} to {}", length_text(design.segment),
                               length_text(design.length), segments, length_text(design.length / kMostSegments),
                               length_text(design.length / kLeastSegments)));
}

/// Layers reach from the bore to the radius, and take the place of one material's numbers.
std::optional<Error> check_section(const CheckContext& context, const Values& values, const SceneInstrument& instrument) {
    const auto text = [&](double length) { return with_unit(length, Dimension::Length, context.units); };
    const double radius = instrument.design.radius;
    if (!(instrument.inner_radius < radius))
        return fail_at(context, values, "inner_radius", fmt::format("found {}; expected less than the radius, {}", text(instrument.inner_radius), text(radius)));
    if (instrument.layers.empty()) return std::nullopt;
    for (const char* key : {"young_modulus", "density"})
        if (values.has(key)) return fail_at(context, values, key, "found beside layers, each of which has its own; expected one of them");
    double inside = instrument.inner_radius;
    for (const TubeLayer& layer : instrument.layers) {
        if (!(layer.outer_radius > inside))
            return fail_at(context, values, "layers", fmt::format("found an outer radius of {} around one of {}; expected them to ascend from the bore", text(layer.outer_radius), text(inside)));
        inside = layer.outer_radius;
    }
    if (std::abs(inside - radius) <= kSameRadius * radius) return std::nullopt;
    return fail_at(context, values, "layers", fmt::format("found a last outer radius of {}; expected the instrument's radius, {}", text(inside), text(radius)));
}

} // namespace

/// Rows of a length from the tip and a factor; they must ascend along the instrument.
static std::optional<Error> read_profile(const Reading& reading, std::string_view key, std::vector<fem::ProfileRow>& profile) {
    const auto& [context, values, scene] = reading;
    const JsonNode* rows = values.find(key);
    if (rows == nullptr) return std::nullopt;
    profile.clear(); // those of a device
    for (std::size_t i = 0; i < rows->children.size(); ++i) {
        const JsonNode& row = rows->children[i];
        const fem::ProfileRow next{values.column(key, row, 0), values.column(key, row, 1)};
        if (i > 0 && !(next.from_tip > profile.back().from_tip))
            return error_at(context, row.at, fmt::format("{}[{}]", values.path(key), i),
                            fmt::format("found {} after {}; expected lengths from the tip that ascend",
                                        with_unit(next.from_tip, Dimension::Length, context.units),
                                        with_unit(profile.back().from_tip, Dimension::Length, context.units)));
        profile.push_back(next);
    }
    return std::nullopt;
}

/// The tip's own stiffness must be absent beside rows, and takes the place of a device's.
std::optional<Error> read_stiffness(const Reading& reading, std::vector<fem::ProfileRow>& stiffness) {
    const Values tip = reading.values.object("tip");
    if (!tip.has("stiffness")) return read_profile(reading, "stiffness", stiffness);
    if (reading.values.has("stiffness"))
        return fail_at(reading.context, tip, "stiffness", "found beside the instrument's rows of stiffness; expected one of them");
    stiffness.clear();
    return std::nullopt;
}

std::optional<Error> read_coating(const Reading& reading, std::vector<fem::ProfileRow>& coating) { return read_profile(reading, "coating", coating); }

/// One material takes the place of a device's layers.
std::optional<Error> read_layers(const Reading& reading, std::vector<TubeLayer>& layers) {
    const Values& values = reading.values;
    const JsonNode* rows = values.find("layers");
    if (rows != nullptr || values.has("young_modulus") || values.has("density")) layers.clear();
    if (rows == nullptr) return std::nullopt;
    for (const JsonNode& row : rows->children) layers.push_back({values.column("layers", row, 0), values.column("layers", row, 1), values.column("layers", row, 2)});
    return std::nullopt;
}

std::optional<Error> read_arcs(const Reading& reading, std::vector<fem::TipArc>& arcs) {
    const Values& tip = reading.values;
    if (const JsonNode* rows = tip.find("arcs")) {
        arcs.clear();
        for (const JsonNode& row : rows->children) arcs.push_back({tip.column("arcs", row, 0), tip.column("arcs", row, 1), tip.column("arcs", row, 2)});
        return std::nullopt;
    }
    const JsonNode* rows = tip.find("points");
    if (rows == nullptr) return std::nullopt;
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < rows->children.size(); ++i) {
        const JsonNode& row = rows->children[i];
        points.emplace_back(tip.column("points", row, 0), tip.column("points", row, 1), tip.column("points", row, 2));
        if (i > 0 && !((points[i] - points[i - 1]).norm() >= kNearestPoints))
            return error_at(reading.context, row.at, fmt::format("{}[{}]", tip.path("points"), i),
                            fmt::format("found the point before it again; expected points that are {} or more apart",
                                        with_unit(kNearestPoints, Dimension::Length, reading.context.units)));
    }
    const double spacing = anatomy::arc_lengths(points).back() / static_cast<double>(kPiecesPerSpan * (points.size() - 1));
    arcs = fem::arcs_along(anatomy::smooth_curve(points, spacing));
    return std::nullopt;
}

std::optional<Error> read_design(const Reading& reading, SceneInstrument& instrument) {
    if (auto error = read_keys<InstrumentKeys>(reading, instrument)) return error;
    if (auto error = check_tip_keys(reading.context, reading.values.object("tip"), instrument)) return error;
    if (auto error = complete_design(reading.context, reading.values, instrument.design)) return error;
    return check_section(reading.context, reading.values, instrument);
}

/// The table of scenes, of the keys that say nothing about where it is used, with the file's own units.
const ObjectSpec& device_table() {
    static const ObjectSpec table = [] {
        ObjectSpec device{"device", "A catheter or guide wire by itself.", "", "", {}};
        device.fields.push_back(text_field("$schema", "Where editors find the schema; not read."));
        device.fields.push_back(object_field("units", units_table(), "Units of all numbers in this file.").required());
        device.fields.push_back(text_field("about", "What it is.").required());
        device.fields.push_back(text_field("source", "Where its numbers are from, and which of them are choices.").required());
        for (const std::string_view key : {"length", "radius", "inner_radius", "layers", "young_modulus", "poisson_ratio", "stiffness", "density", "tip",
                                           "coating", "friction", "min_bend_radius", "segment", "skin_triangles", "drag", "whip_drag"}) {
            FieldSpec field = *table_of<InstrumentKeys>().find(key);
            field.is_required = key == "length" || key == "radius";
            device.fields.push_back(std::move(field));
        }
        return device;
    }();
    return table;
}

Result<Device> parse_device(std::string_view text, const std::filesystem::path& file) {
    CheckContext context{file.string(), file.parent_path(), {}, {}, {}};
    const auto tree = parse_checked(text, device_table(), context);
    if (!tree) return tree.error();
    const Scene none;
    Device device;
    const Values values(&tree.value(), table_of<InstrumentKeys>(), context.units, "");
    if (auto error = read_design({context, values, none}, device.instrument)) return *error;
    device.about = tree->find("about")->text;
    device.source = tree->find("source")->text;
    device.questions = std::move(context.questions);
    return device;
}

std::optional<Error> begin_as_device(const CheckContext& context, const Values& values, SceneInstrument& instrument) {
    const std::string name = values.text("device");
    const auto take = [&](const Result<Device>& device) -> std::optional<Error> {
        if (!device.ok()) return device.error();
        const std::string own_name = instrument.name;
        instrument = device->instrument;
        instrument.name = own_name;
        instrument.device = name;
        return std::nullopt;
    };
    if (name.ends_with(".json")) {
        const Result<std::filesystem::path> file = resolve_file(name, context.folder);
        if (!file.ok()) return fail_at(context, values, "device", file.error().message, file.error().code);
        const Result<std::string> text = read_json_file(*file);
        if (!text.ok()) return text.error();
        if (auto error = take(parse_device(*text, *file))) return error;
        instrument.device_file = *file;
        return std::nullopt;
    }
    if (const std::optional<std::string_view> text = find_device(name)) return take(parse_device(*text, name + ".json"));
    return fail_at(context, values, "device", refuse_unknown("device", name, device_names()) + ", or a file, NAME.json");
}

} // namespace trocar::engine
