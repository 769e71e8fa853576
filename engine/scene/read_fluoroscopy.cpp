// Reads "outputs.fluoroscopy": angles in the words of the angiography suite, sizes, names.
#include "engine/scene/describe_fluoroscopy.hpp"
#include "engine/scene/read_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

namespace trocar::engine {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// The words before an angle: which sign they stand for.
struct AngleWords {
    std::string_view key, positive, negative;
    double most; // rad
};
constexpr AngleWords kPrimary{"primary", "LAO", "RAO", std::numbers::pi}, kSecondary{"secondary", "CRA", "CAU", 0.5 * std::numbers::pi};

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    return text;
}

/// rad; none where the text is no angle
std::optional<double> parse_angle(std::string_view text, const AngleWords& words) {
    text = trimmed(text);
    double sign = 1.0;
    const bool is_positive = text.starts_with(words.positive), is_negative = text.starts_with(words.negative);
    if (is_positive || is_negative) {
        sign = is_negative ? -1.0 : 1.0;
        text = trimmed(text.substr(words.positive.size()));
    }
    double number = 0.0;
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (failed != std::errc() || !std::isfinite(number)) return std::nullopt;
    if ((is_positive || is_negative) && number < 0.0) return std::nullopt; // "LAO -30" says two things
    const std::string_view unit = trimmed(text.substr(static_cast<std::size_t>(end - text.data())));
    if (unit != "deg" && unit != "rad") return std::nullopt;
    return sign * number * (unit == "deg" ? kDegree : 1.0);
}

std::optional<Error> read_angle(const Reading& reading, const AngleWords& words, double& angle) {
    const auto& [context, values, scene] = reading;
    const JsonNode* node = values.find(words.key);
    if (node == nullptr) return std::nullopt;
    if (node->type == JsonType::Number)
        angle = node->number * context.units.factor(Dimension::Angle);
    else if (const auto parsed = parse_angle(node->text, words))
        angle = *parsed;
    else
        return fail_at(context, values, words.key,
                       fmt::format("found \"{}\"; expected an angle as \"{} 30 deg\", \"{} 30 deg\" or \"-30 deg\"", node->text, words.positive,
                                   words.negative));
    if (std::abs(angle) <= words.most * (1.0 + kLimitTolerance)) return std::nullopt;
    return fail_at(context, values, words.key,
                   fmt::format("found {:g} deg, which no C-arm reaches; expected -{:g} to {:g} deg", angle / kDegree, words.most / kDegree, words.most / kDegree));
}

bool is_name(std::string_view name) {
    return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    });
}

/// What no single key can say.
std::optional<Error> check_view(const Reading& reading, const XrayView& view, const std::vector<XrayView>& before) {
    const auto& [context, values, scene] = reading;
    if (!is_name(view.name))
        return fail_at(context, values, "name", fmt::format("found \"{}\"; expected 1 to 64 letters, digits, - or _: files are named by it", view.name));
    for (const XrayView& other : before)
        if (other.name == view.name)
            return fail_at(context, values, "name", fmt::format("found \"{}\" a second time; expected a name for each view", view.name));
    if (!(view.sod < view.sid))
        return fail_at(context, values, "sod",
                       fmt::format("found {:g} m from the source to the isocentre and {:g} m to the detector; expected the detector beyond the isocentre",
                                   view.sod, view.sid));
    if (view.pixel_count() > kMostXrayPixels)
        return fail_at(context, values, "pixels", fmt::format("found {} x {}; expected at most {} in all", view.pixels[0], view.pixels[1], kMostXrayPixels));
    if (!view.arm.empty() && (values.has("primary") || values.has("secondary")))
        return fail_at(context, values, "arm", "the arm moves, and stands at primary and secondary; expected one of the two");
    return std::nullopt;
}

} // namespace

std::optional<Error> read_primary(const Reading& reading, double& angle) { return read_angle(reading, kPrimary, angle); }
std::optional<Error> read_secondary(const Reading& reading, double& angle) { return read_angle(reading, kSecondary, angle); }

std::optional<Error> read_arm(const Reading& reading, std::vector<ArmRow>& arm) {
    const auto& [context, values, scene] = reading;
    const JsonNode* rows = values.find("arm");
    if (rows == nullptr) return std::nullopt;
    for (const JsonNode& row : rows->children) {
        arm.push_back({values.column("arm", row, 0), values.column("arm", row, 1), values.column("arm", row, 2)});
        if (arm.size() > 1 && !(arm[arm.size() - 2].time < arm.back().time))
            return fail_at(context, values, "arm", "times do not ascend; expected each later than the one before");
    }
    return std::nullopt;
}

std::optional<Error> read_detector(const Reading& reading, std::array<double, 2>& detector) {
    const JsonNode* node = reading.values.find("detector");
    if (node == nullptr) return std::nullopt;
    for (std::size_t k = 0; k < 2; ++k) detector[k] = reading.values.column("detector", *node, k);
    return std::nullopt;
}

std::optional<Error> read_xray_pixels(const Reading& reading, std::array<unsigned, 2>& pixels) {
    const JsonNode* node = reading.values.find("pixels");
    if (node == nullptr) return std::nullopt;
    for (std::size_t k = 0; k < 2; ++k) {
        const double edge = node->children[k].number;
        if (edge != std::floor(edge)) return fail_at(reading.context, reading.values, "pixels", fmt::format("found {:g}; expected integers", edge));
        pixels[k] = static_cast<unsigned>(edge);
    }
    return std::nullopt;
}

std::optional<Error> read_window(const Reading& reading, std::optional<std::array<double, 2>>& window) {
    const JsonNode* node = reading.values.find("window");
    if (node == nullptr) return std::nullopt;
    window = {node->children[0].number, node->children[1].number};
    if ((*window)[0] < (*window)[1]) return std::nullopt;
    return fail_at(reading.context, reading.values, "window",
                   fmt::format("found {:g} and {:g}; expected less attenuation for white than for black", (*window)[0], (*window)[1]));
}

std::optional<Error> read_bits(const Reading& reading, unsigned& bits) {
    if (!reading.values.has("bits")) return std::nullopt;
    bits = reading.values.count<unsigned>("bits");
    if (bits == 8 || bits == 16) return std::nullopt;
    return fail_at(reading.context, reading.values, "bits", fmt::format("found {}; expected 8 or 16", bits));
}

std::optional<Error> read_matter(const Reading& reading, std::vector<std::pair<std::string, XrayMatter>>& matter) {
    const auto& context = reading.context;
    const auto& values = reading.values;
    const auto& scene = reading.scene;
    const JsonNode* node = values.find("matter");
    if (node == nullptr) return std::nullopt;
    const std::vector<std::string_view> words = matter_words();
    const auto is_there = [&](const std::string& name) {
        return std::any_of(scene.bodies.begin(), scene.bodies.end(), [&](const SceneBody& body) { return body.name == name; }) ||
               std::any_of(scene.instruments.begin(), scene.instruments.end(), [&](const SceneInstrument& one) { return one.name == name; });
    };
    for (const JsonNode& member : node->children) {
        if (!is_there(member.key))
            return fail_at(context, values, "matter", fmt::format("found \"{}\"; expected the name of a body or an instrument", member.key));
        const auto word = std::find(words.begin(), words.end(), member.text);
        matter.emplace_back(member.key, static_cast<XrayMatter>(word - words.begin()));
    }
    return std::nullopt;
}

std::optional<Error> read_views(const Reading& reading, std::vector<XrayView>& views) {
    const auto& [context, values, scene] = reading;
    const JsonNode* node = values.find("views");
    for (std::size_t i = 0; node != nullptr && i < node->children.size(); ++i) {
        const Values own = values.element("views", node->children[i], fmt::format("{}[{}]", values.path("views"), i));
        XrayView view;
        if (auto error = read_keys<XrayViewKeys>({context, own, scene}, view)) return error;
        if (auto error = check_view({context, own, scene}, view, views)) return error;
        views.push_back(std::move(view));
    }
    return std::nullopt;
}

} // namespace trocar::engine
