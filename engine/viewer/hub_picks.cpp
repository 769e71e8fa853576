// What the hub does about picked places: they are the driver's, all viewers see them, and whoever saves a scene is told.
#include "engine/viewer/hub.hpp"

namespace trocar::engine::viewer {

namespace {

/// Without file and line: the scene that it is about was not written.
std::string describe_error(const Error& error) { return error.key.empty() ? error.message : error.key + ": " + error.message; }

} // namespace

std::string Hub::handle_pick(unsigned client, const Request& request) {
    if (std::string refused = refuse(client); !refused.empty()) return refused;
    if (const auto* save = std::get_if<SaveScene>(&request)) return saver_.start(client, picker_.picks(), *save);
    if (std::holds_alternative<ForgetPicks>(request))
        picker_.forget();
    else if (const auto picked = picker_.pick(std::get<PickPlace>(request)); !picked.ok())
        return picked.error().message;
    tell_picks();
    return {};
}

void Hub::tell_picks() {
    const std::string text = picks_text();
    for (const auto& [number, weak] : clients_)
        if (const auto client = weak.lock()) client->tell(text);
}

void Hub::answer_saved() {
    const auto answer = saver_.take();
    if (!answer) return;
    const auto asked = clients_.find(answer->client);
    const auto client = asked == clients_.end() ? nullptr : asked->second.lock();
    if (client == nullptr) return; // it has gone
    client->tell(answer->saved.ok() ? saved_scene_message(*answer->saved) : error_message("nothing was saved: " + describe_error(answer->saved.error())));
}

} // namespace trocar::engine::viewer
