#include "engine/prepare/patient_cache.hpp"

#include "engine/prepare/cache.hpp"

#include <nlohmann/json.hpp>

namespace trocar::engine {

namespace {

nlohmann::json pack_landmarks(const std::vector<anatomy::Landmark>& landmarks) {
    nlohmann::json list = nlohmann::json::array();
    for (const anatomy::Landmark& l : landmarks)
        list.push_back({{"name", l.name},
                        {"position", {l.position.x(), l.position.y(), l.position.z()}},
                        {"direction", {l.direction.x(), l.direction.y(), l.direction.z()}},
                        {"radius", l.radius}});
    return list;
}

std::optional<std::vector<anatomy::Landmark>> unpack_landmarks(const std::string& text) {
    const nlohmann::json list = nlohmann::json::parse(text, nullptr, false);
    if (!list.is_array()) return std::nullopt;
    std::vector<anatomy::Landmark> landmarks;
    for (const nlohmann::json& entry : list) {
        const auto& p = entry["position"];
        const auto& d = entry["direction"];
        landmarks.push_back({entry["name"].get<std::string>(), Vec3(p[0].get<double>(), p[1].get<double>(), p[2].get<double>()),
                             Vec3(d[0].get<double>(), d[1].get<double>(), d[2].get<double>()), entry["radius"].get<double>()});
    }
    return landmarks;
}

std::optional<anatomy::Anatomy> read_patient(const std::string& key) {
    const auto liver = read_cache("liver", key), lumen = read_cache("lumen", key), marks = read_cache("landmarks", key);
    if (!liver || !lumen || !marks) return std::nullopt;
    auto liver_mesh = unpack_triangles(*liver);
    auto lumen_mesh = unpack_triangles(*lumen);
    auto landmarks = unpack_landmarks(*marks);
    if (!liver_mesh || !lumen_mesh || !landmarks) return std::nullopt;
    anatomy::Anatomy patient;
    patient.liver = std::move(*liver_mesh);
    patient.lumen = std::move(*lumen_mesh);
    patient.landmarks = std::move(*landmarks);
    return patient;
}

} // namespace

std::string patient_key(const anatomy::Recipe& recipe) {
    ContentHash hash;
    hash.feed(maker_version());
    for (const anatomy::RecipeField& field : anatomy::recipe_fields()) {
        hash.feed(field.name);
        hash.feed(anatomy::recipe_value(recipe, field));
    }
    return hash.hex();
}

Result<anatomy::Anatomy> make_patient(const anatomy::Recipe& recipe, const std::string& key) {
    if (auto cached = read_patient(key)) return std::move(*cached);
    Result<anatomy::Anatomy> patient = anatomy::generate(recipe);
    if (!patient.ok()) return patient;
    write_cache("liver", key, pack_mesh(patient->liver));
    write_cache("lumen", key, pack_mesh(patient->lumen));
    write_cache("landmarks", key, pack_landmarks(patient->landmarks).dump());
    patient->centreline = {}; // as it would come from the cache
    return patient;
}

} // namespace trocar::engine
