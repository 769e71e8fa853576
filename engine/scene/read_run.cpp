// Reads "time", "budget" and "outputs".
#include "engine/scene/describe_run.hpp"
#include "engine/scene/read_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

constexpr double kMostSteps = 1e9;

/// A count is spread evenly: the last one at the end. With fluoroscopy every picture has an X-ray beside it.
void spread_pictures(unsigned count, const Scene& scene, std::vector<PictureSpec>& pictures) {
    for (unsigned i = 1; i <= count; ++i) {
        const double time = scene.time.duration * i / count;
        pictures.push_back({PictureView::Anatomy, time});
        if (scene.effects.fluoroscopy) pictures.push_back({PictureView::Fluoroscopy, time});
    }
}

std::optional<Error> read_picture(const Reading& reading, PictureSpec& picture) {
    const auto& [context, values, scene] = reading;
    if (auto error = read_keys<PictureKeys>(reading, picture)) return error;
    if (picture.view == PictureView::Fluoroscopy && !scene.effects.fluoroscopy)
        return fail_at(context, values, "view", "found \"fluoroscopy\", but that effect is off; expected it among the effects");
    if (picture.view == PictureView::Tip && scene.instruments.empty())
        return fail_at(context, values, "view", "found \"tip\", but the scene has no instrument; expected \"anatomy\"");
    if (picture.time <= scene.time.duration) return std::nullopt;
    return fail_at(context, values, "time",
                   fmt::format("found {}; expected at most the duration, {}", with_unit(picture.time, Dimension::Time, context.units),
                               with_unit(scene.time.duration, Dimension::Time, context.units)));
}

} // namespace

std::optional<Error> read_substeps(const Reading& reading, unsigned& substeps) {
    const JsonNode* node = reading.values.find("substeps");
    if (node != nullptr && node->type == JsonType::Number) substeps = static_cast<unsigned>(node->number);
    return std::nullopt;
}

std::optional<Error> read_time(const Reading& reading, TimeSpec& time) {
    const auto& [context, values, scene] = reading;
    if (auto error = read_keys<TimeKeys>(reading, time)) return error;
    const auto time_text = [&units = context.units](double t) { return with_unit(t, Dimension::Time, units); };
    if (time.duration < time.step)
        return fail_at(
            context, values, "duration",
            fmt::format("found {}, less than a step of {}; expected at least one step", time_text(time.duration), time_text(time.step)));
    if (time.duration / time.step > kMostSteps)
        return fail_at(
            context, values, "step",
            fmt::format("found {}, which makes {:.3g} steps; expected at most 10^9", time_text(time.step), time.duration / time.step));
    if (time.substeps <= time.max_substeps) return std::nullopt;
    return fail_at(context, values, "substeps",
                   fmt::format("found {}; expected at most max_substeps, {}", time.substeps, time.max_substeps));
}

std::optional<Error> read_limit(const Reading& reading, BudgetLimits& limits) {
    if (!reading.values.has("limit")) return std::nullopt;
    const auto parsed = parse_budget(reading.values.text("limit"));
    if (!parsed) return fail_at(reading.context, reading.values, "limit", parsed.error().message);
    limits = parsed->limits;
    return std::nullopt;
}

std::optional<Error> read_drop(const Reading& reading, std::vector<Droppable>& drop) {
    const auto& [context, values, scene] = reading;
    const JsonNode* list = values.find("drop");
    if (list == nullptr) return std::nullopt;
    if (values.text("scope") != "step" && !list->children.empty())
        return fail_at(context, values, "drop",
                       "a budget for collision leaves the exact stage out by itself and nothing "
                       "else; expected it with \"scope\": \"step\"");
    for (std::size_t i = 0; i < list->children.size(); ++i) {
        const JsonNode& word = list->children[i];
        const Droppable effect = word.text == "elasticity" ? Droppable::Elasticity : Droppable::ExactContact;
        if (std::find(drop.begin(), drop.end(), effect) != drop.end())
            return error_at(context, word.at, fmt::format("{}[{}]", values.path("drop"), i),
                            fmt::format("\"{}\" is listed twice; expected once", word.text));
        drop.push_back(effect);
    }
    return std::nullopt;
}

std::optional<Error> read_budget(const Reading& scene, BudgetSpec& budget) {
    const JsonNode* node = scene.values.find("budget");
    if (node == nullptr) return std::nullopt;
    if (node->type == JsonType::Object) return read_keys<BudgetKeys>({scene.context, scene.values.object("budget"), scene.scene}, budget);
    const auto parsed = parse_budget(node->text);
    if (!parsed) return fail_at(scene.context, scene.values, "budget", parsed.error().message);
    budget = *parsed;
    return std::nullopt;
}

std::optional<Error> read_picture_size(const Reading& reading, unsigned& width, unsigned& height) {
    const JsonNode* size = reading.values.find("size");
    if (size == nullptr) return std::nullopt;
    for (const JsonNode& edge : size->children)
        if (edge.number != std::floor(edge.number))
            return fail_at(reading.context, reading.values, "size", fmt::format("found {}; expected integers, in pixels", edge.text));
    width = static_cast<unsigned>(size->children[0].number);
    height = static_cast<unsigned>(size->children[1].number);
    return std::nullopt;
}

std::optional<Error> read_pictures(const Reading& reading, std::vector<PictureSpec>& pictures) {
    const auto& [context, values, scene] = reading;
    const JsonNode* node = values.find("pictures");
    if (node == nullptr) return std::nullopt;
    if (node->type == JsonType::Number) spread_pictures(static_cast<unsigned>(node->number), scene, pictures);
    for (std::size_t i = 0; i < node->children.size(); ++i) {
        const Values picture = values.element("pictures", node->children[i], fmt::format("{}[{}]", values.path("pictures"), i));
        if (auto error = read_picture({context, picture, scene}, pictures.emplace_back())) return error;
    }
    return std::nullopt;
}

} // namespace trocar::engine
