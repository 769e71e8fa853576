// Reads what holds, moves and loads the nodes of a deformable body.
#include "engine/io/file_bytes.hpp"
#include "engine/scene/describe_body.hpp"
#include "engine/scene/read_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace trocar::engine {
namespace {

/// The time of a row, later than the one before it.
std::optional<Error> check_order(const Reading& reading, std::string_view key, const JsonNode& row, std::size_t count, double last) {
    const double time = reading.values.column(key, row, 0);
    if (count == 0 || time > last) return std::nullopt;
    return error_at(reading.context, row.at, fmt::format("{}[{}]", reading.values.path(key), count),
                    fmt::format("found the time {} after {}; expected increasing times",
                                with_unit(time, Dimension::Time, reading.context.units),
                                with_unit(last, Dimension::Time, reading.context.units)));
}

std::optional<Error> read_rows(const Reading& reading, std::string_view key, std::vector<LoadRow>& rows) {
    const JsonNode* list = reading.values.find(key);
    if (list == nullptr) return std::nullopt;
    for (const JsonNode& row : list->children) {
        if (auto error = check_order(reading, key, row, rows.size(), rows.empty() ? 0.0 : rows.back().time)) return error;
        rows.push_back({reading.values.column(key, row, 0), reading.values.column(key, row, 1)});
    }
    return std::nullopt;
}

std::optional<Error> read_held(const Reading& reading, const JsonNode& node, HeldRegion& held) {
    if (auto error = read_region(reading, node, held.region)) return error;
    if (auto error = read_keys<HeldMotionKeys>(reading, held)) return error;
    for (const char* key : {"turn_point", "turn_axis"})
        if (reading.values.has(key) && held.turns.empty())
            return fail_at(reading.context, reading.values, key, "unused key: nothing turns here; expected turns added or this left out");
    return std::nullopt;
}

std::optional<Error> read_load(const Reading& reading, const JsonNode& node, LoadSpec& load) {
    if (node.find("force") != nullptr) {
        load.kind = LoadKind::Force;
        return read_keys<ForceLoadKeys>(reading, load);
    }
    if (node.find("traction") != nullptr) {
        load.kind = LoadKind::Traction;
        return read_keys<TractionLoadKeys>(reading, load);
    }
    if (node.find("pressure") != nullptr) {
        load.kind = LoadKind::Pressure;
        return read_keys<PressureLoadKeys>(reading, load);
    }
    if (node.find("acceleration") != nullptr) {
        load.kind = LoadKind::Acceleration;
        return read_keys<AccelerationLoadKeys>(reading, load);
    }
    load.kind = LoadKind::Spring;
    if (auto error = read_keys<SpringLoadKeys>(reading, load)) return error;
    for (const LoadRow& row : load.over)
        if (row.value < 0.0)
            return fail_at(reading.context, reading.values, "over", fmt::format("found the factor {:g} of a spring; expected 0 or more: one below would push away", row.value));
    return std::nullopt;
}

} // namespace

std::optional<Error> read_region(const Reading& reading, const JsonNode& node, FixedRegion& region) {
    if (node.find("direction") != nullptr) {
        region.kind = RegionKind::Direction;
        return read_keys<DirectionRegionKeys>(reading, region);
    }
    if (node.find("sphere") != nullptr) {
        region.kind = RegionKind::Sphere;
        return read_keys<SphereRegionKeys>(reading, region);
    }
    if (node.find("plane") != nullptr) {
        region.kind = RegionKind::Plane;
        return read_keys<PlaneRegionKeys>(reading, region);
    }
    if (node.find("near") != nullptr) {
        region.kind = RegionKind::Near;
        return read_keys<NearRegionKeys>(reading, region);
    }
    if (node.find("nodes") != nullptr) {
        region.kind = RegionKind::Listed;
        return read_keys<ListedRegionKeys>(reading, region);
    }
    region.kind = RegionKind::Box;
    return read_keys<BoxRegionKeys>(reading, region);
}

/// Ids from a text; what is none, and its line.
static std::optional<std::string> read_ids(std::string_view text, std::vector<Index>& nodes) {
    std::size_t line = 1;
    bool comment = false;
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        if (c == '\n') ++line, comment = false;
        if (c == '#') comment = true;
        if (comment || c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',') {
            ++at;
            continue;
        }
        Index id = 0;
        const auto [end, failed] = std::from_chars(text.data() + at, text.data() + text.size(), id);
        const auto stop = static_cast<std::size_t>(end - text.data());
        const bool ends = stop == text.size() || std::string_view(" \t\r\n,#").find(text[stop]) != std::string_view::npos;
        if (failed != std::errc() || !ends)
            return fmt::format("line {}: found \"{}\"; expected ids of nodes, 0 or more", line, text.substr(at, text.find_first_of(" \t\r\n,#", at) - at).substr(0, 40));
        nodes.push_back(id);
        at = stop;
    }
    return std::nullopt;
}

std::optional<Error> read_node_list(const Reading& reading, std::filesystem::path& file, std::vector<Index>& nodes) {
    if (!reading.values.has("nodes")) return std::nullopt;
    file = checked_file(reading.context, reading.values.text("nodes"));
    const Result<std::string> text = read_file_bytes(file);
    if (!text) return fail_at(reading.context, reading.values, "nodes", text.error().to_string());
    if (const auto problem = read_ids(*text, nodes))
        return fail_at(reading.context, reading.values, "nodes", fmt::format("{}: {}", file.string(), *problem));
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    if (!nodes.empty()) return std::nullopt;
    return fail_at(reading.context, reading.values, "nodes", fmt::format("{} lists no node; expected one at least", file.string()));
}

template <class Item, class Read>
static std::optional<Error> read_each(const Reading& body, std::string_view key, std::vector<Item>& items, Read read) {
    const JsonNode* list = body.values.find(key);
    for (std::size_t i = 0; list != nullptr && i < list->children.size(); ++i) {
        const JsonNode& node = list->children[i];
        const Values values = body.values.element(key, node, fmt::format("{}[{}]", body.values.path(key), i));
        if (auto error = read({body.context, values, body.scene}, node, items.emplace_back())) return error;
    }
    return std::nullopt;
}

std::optional<Error> read_fixed(const Reading& body, std::vector<HeldRegion>& fixed) { return read_each(body, "fixed", fixed, read_held); }

std::optional<Error> read_loads(const Reading& body, std::vector<LoadSpec>& loads) { return read_each(body, "loads", loads, read_load); }

std::optional<Error> read_where(const Reading& reading, std::optional<FixedRegion>& region) {
    const JsonNode* node = reading.values.find("where");
    if (node == nullptr) return std::nullopt;
    const Values values = reading.values.object("where");
    return read_region({reading.context, values, reading.scene}, *node, region.emplace());
}

std::optional<Error> read_over(const Reading& reading, std::vector<LoadRow>& rows) { return read_rows(reading, "over", rows); }

std::optional<Error> read_rotation(const Reading& reading, std::vector<LoadRow>& rows) { return read_rows(reading, "rotation", rows); }

std::optional<Error> read_turns(const Reading& reading, std::vector<LoadRow>& rows) { return read_rows(reading, "turns", rows); }

std::optional<Error> read_moves(const Reading& reading, std::vector<KeyFrame>& moves) { return read_frames(reading, "moves", moves); }

std::optional<Error> read_frames(const Reading& reading, std::string_view key, std::vector<KeyFrame>& frames) {
    const JsonNode* rows = reading.values.find(key);
    if (rows == nullptr) return std::nullopt;
    for (const JsonNode& row : rows->children) {
        if (auto error = check_order(reading, key, row, frames.size(), frames.empty() ? 0.0 : frames.back().time)) return error;
        KeyFrame frame{reading.values.column(key, row, 0), {}};
        for (std::size_t i = 0; i < 3; ++i) frame.displacement[static_cast<int>(i)] = reading.values.column(key, row, i + 1);
        frames.push_back(frame);
    }
    return std::nullopt;
}

} // namespace trocar::engine
