#include "engine/viewer/place_messages.hpp"

#include "engine/report/places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace trocar::engine::viewer {

namespace {

using Json = nlohmann::ordered_json;

Json coordinates(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

void append(Json& list, const Vec3& v) {
    for (int axis = 0; axis < 3; ++axis) list.push_back(static_cast<float>(v[axis]));
}

/// Each point goes with the nearest corner of the nearest triangle.
void tie_to_wall(const std::vector<Vec3>& points, const TriMesh& wall, Json& centreline) {
    const TriangleTree tree(wall);
    for (const Vec3& p : points) {
        const SurfacePoint near = tree.closest(p).value_or(SurfacePoint{0});
        const auto corner = std::max_element(near.bary.begin(), near.bary.end()) - near.bary.begin();
        const Index vertex = wall.triangles[near.triangle][static_cast<std::size_t>(corner)];
        centreline["vertices"].push_back(vertex);
        append(centreline["offsets"], p - wall.vertices[vertex]);
    }
}

Json describe_centreline(const spheretree::CentrelineTree& tree, const BodyModel& body) {
    Json centreline{{"points", Json::array()}, {"parents", Json::array()}, {"vertices", nullptr}, {"offsets", nullptr}};
    for (const Vec3& p : tree.points) append(centreline["points"], p);
    for (const Index parent : tree.parents) centreline["parents"].push_back(parent == kNoIndex ? -1 : static_cast<std::int64_t>(parent));
    if (body.moves()) tie_to_wall(tree.points, body.surface, centreline);
    return centreline;
}

} // namespace

Json describe_mark(const Vec3& position, const std::string& name, const SceneModel& model) {
    Json mark{{"name", name}, {"position", coordinates(position)}, {"part", nullptr}};
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].hollow) continue;
        const std::vector<Vec3>& vertices = model.bodies[i].surface.vertices;
        for (std::size_t v = 0; v < vertices.size(); ++v)
            if (const double distance = (vertices[v] - position).squaredNorm(); distance < nearest) {
                nearest = distance;
                mark["part"] = i;
                mark["vertex"] = v;
                mark["offset"] = coordinates(position - vertices[v]);
            }
    }
    return mark;
}

Json describe_vessel(const LumenPlaces* places, const SceneModel& model) {
    if (places == nullptr) return nullptr;
    const InstrumentModel& instrument = model.instruments[kLeadInstrument];
    Json entry = describe_mark(instrument.port.position, fmt::format("entry of {}", instrument.name), model);
    entry["direction"] = coordinates(instrument.port.direction);
    return {{"part", instrument.lumen}, {"instrument", instrument.name}, {"entry", std::move(entry)},
            {"centreline", describe_centreline(places->centreline(), model.bodies[instrument.lumen])}};
}

std::string picks_message(const Picks& picks, const SceneModel& model) {
    Json message{{"type", "picks"}, {"target", nullptr}, {"entry", nullptr}};
    if (picks.target) {
        message["target"] = describe_mark(picks.target->position, "picked target", model);
        message["target"]["radius"] = picks.target->radius;
    }
    if (picks.entry) {
        const EntryPlace& place = picks.entry->place;
        message["entry"] = describe_mark(place.position, "picked entry", model);
        message["entry"]["radius"] = place.radius;
        message["entry"]["direction"] = coordinates(place.direction);
    }
    return message.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string saved_scene_message(const SavedScene& saved) {
    const std::string file = saved.file.string();
    const Json message{{"type", "saved_scene"}, {"file", file}, {"command", "trocar view " + shell_quoted(file)}, {"notices", saved.notices}};
    return message.dump(-1, ' ', false, Json::error_handler_t::replace);
}

} // namespace trocar::engine::viewer
