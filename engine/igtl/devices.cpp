#include "engine/igtl/devices.hpp"

#include "engine/igtl/codec.hpp"
#include "engine/state/state.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>

namespace trocar::engine::igtl {

namespace {

using Json = nlohmann::ordered_json;

/// Bytes of the longest ending, "_drive".
constexpr std::size_t kEnding = 6;

/// Printable ASCII of at most so many bytes.
std::string plain(const std::string& name, std::size_t most) {
    std::string cut = name.substr(0, most);
    std::replace_if(cut.begin(), cut.end(), [](unsigned char c) { return c <= ' ' || c > '~'; }, '_');
    return cut.empty() ? "_" : cut;
}

/// A name whose like, with every ending, is not taken yet.
std::string free_name(const std::string& wanted, std::size_t most, const std::vector<std::string>& endings, std::set<std::string>& taken) {
    std::string name = plain(wanted, most);
    const auto is_taken = [&](const std::string& ending) { return taken.contains(name + ending); };
    for (std::size_t number = 2; std::any_of(endings.begin(), endings.end(), is_taken); ++number) {
        const std::string mark = fmt::format("~{}", number);
        name = plain(wanted, most - mark.size()) + mark;
    }
    for (const std::string& ending : endings) taken.insert(name + ending);
    return name;
}

} // namespace

Devices name_devices(const SceneModel& model) {
    std::set<std::string> taken{kProgramDevice, kStateDevice, kSceneDevice, kCommandDevice};
    Devices devices;
    for (const InstrumentModel& instrument : model.instruments) {
        const std::string name = free_name(instrument.name, kLongestName - kEnding, {"", "_tip", "_drive"}, taken);
        devices.instruments.push_back({name, name + "_tip", name + "_drive"});
    }
    for (const BodyModel& body : model.bodies) devices.bodies.push_back(free_name(body.name, kLongestName, {""}, taken));
    return devices;
}

std::string describe_scene(const std::string& scene, const SceneModel& model, const Devices& devices) {
    Json bodies = Json::array(), instruments = Json::array();
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        bodies.push_back({{"name", model.bodies[i].name}, {"device", devices.bodies[i]}, {"moves", model.bodies[i].moves()}});
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const InstrumentModel& instrument = model.instruments[i];
        Json described{{"name", instrument.name}, {"device", devices.instruments[i].skin}, {"tip", devices.instruments[i].tip}};
        if (i == kLeadInstrument) {
            described["drive"] = devices.instruments[i].drive;
            described["most_mm_per_s"] = 1e3 * instrument.limits.speed;
        }
        instruments.push_back(std::move(described));
    }
    const Json described{{"scene", scene}, {"units", "mm, RAS"}, {"bodies", std::move(bodies)}, {"instruments", std::move(instruments)}};
    return described.dump(-1, ' ', true, Json::error_handler_t::replace);
}

} // namespace trocar::engine::igtl
