#include "engine/igtl/bridge.hpp"

#include "engine/viewer/listen.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace trocar::engine::igtl {

namespace {

/// Until the next try where a connection could not be accepted.
constexpr std::chrono::milliseconds kAcceptAgain{100};

Transform frame_of(const viewer::TipPose& tip) { return {tip.across, tip.direction.cross(tip.across), tip.direction, tip.position}; }

Bridge::Packed share(std::string bytes) { return std::make_shared<const std::string>(std::move(bytes)); }

} // namespace

Result<std::shared_ptr<void>> Bridge::open(viewer::Hub& hub, const SceneModel& model, const BridgeOptions& options) {
    if (!has_library())
        return Error{ErrorCode::MissingTool,
                     "this program was built without OpenIGTLink; expected the package libopenigtlink-dev, and a build after it was installed",
                     {},
                     0,
                     0,
                     "--igtl"};
    auto bridge = std::make_shared<Bridge>(hub, model, options);
    if (const auto listens = viewer::listen_at(bridge->acceptor_, options.address, options.port, "--igtl"); !listens.ok()) return listens.error();
    if (options.listens) options.listens(bridge->acceptor_.local_endpoint().port());
    bridge->accept();
    return std::shared_ptr<void>(bridge);
}

Bridge::Bridge(viewer::Hub& hub, const SceneModel& model, const BridgeOptions& options)
    : hub_(hub), model_(model), options_(options), devices_(name_devices(model)), interval_ns_(static_cast<std::int64_t>(1e9 / options.rate)),
      surfaces_(model.bodies.size() + model.instruments.size()), packed_of_(surfaces_.size()), acceptor_(hub.io()), pause_(hub.io()) {}

void Bridge::accept() {
    acceptor_.async_accept([weak = weak_from_this()](const boost::system::error_code& failed, Tcp::socket socket) {
        const auto self = weak.lock();
        if (self == nullptr || failed == boost::asio::error::operation_aborted) return;
        if (failed) { // out of descriptors, say
            self->pause_.expires_after(kAcceptAgain);
            return self->pause_.async_wait([weak](const boost::system::error_code& stopped) {
                if (const auto later = weak.lock(); later != nullptr && !stopped) later->accept();
            });
        }
        if (self->clients_ < kMostClients && self->hub_.has_free_place())
            serve_client(self, std::move(socket));
        else
            self->complain(Complaint::TooMany, fmt::format("OpenIGTLink: more than {} clients; further ones are closed", self->clients_));
        self->accept();
    });
}

void Bridge::complain(Complaint about, const std::string& sentence) {
    if (told_.insert(about).second && options_.say) options_.say(sentence);
}

/// A part that moves is packed once by the library, and then only its points change.
Bridge::Packed Bridge::pack_part(std::size_t part) {
    const viewer::Snapshot& shown = hub_.shown();
    const std::vector<viewer::Point>& points = shown.surfaces[part];
    const bool stands = !shown.moves[part] || packed_of_[part] == hub_.frames().latest();
    packed_of_[part] = hub_.frames().latest();
    if (surfaces_[part] != nullptr) return stands ? surfaces_[part] : surfaces_[part] = share(move_surface(*surfaces_[part], time_s(), points));
    const bool is_body = part < model_.bodies.size();
    const std::size_t instrument = part - model_.bodies.size();
    const std::vector<Triangle>& triangles = is_body ? model_.bodies[part].surface.triangles : model_.instruments[instrument].skin.triangles;
    if (points.empty() || triangles.empty()) return nullptr;
    const std::string& name = is_body ? devices_.bodies[part] : devices_.instruments[instrument].skin;
    return surfaces_[part] = share(pack_surface(name, time_s(), points, triangles));
}

const std::vector<Bridge::Packed>& Bridge::frame() {
    const std::uint32_t latest = hub_.frames().latest();
    if (latest != 0 && latest == frame_id_) return frame_;
    frame_id_ = latest;
    frame_.clear();
    const viewer::Snapshot& shown = hub_.shown();
    for (std::size_t i = 0; i < shown.tips.size(); ++i)
        frame_.push_back(share(pack_transform(devices_.instruments[i].tip, time_s(), frame_of(shown.tips[i]))));
    frame_.push_back(share(pack_string(kStateDevice, time_s(), state())));
    for (std::size_t part = 0; part < surfaces_.size(); ++part)
        if (shown.moves[part])
            if (auto packed = pack_part(part)) frame_.push_back(std::move(packed));
    return frame_;
}

std::vector<Bridge::Packed> Bridge::scene() {
    std::vector<Packed> messages{share(pack_string(kSceneDevice, time_s(), describe_scene(hub_.scene().name, model_, devices_)))};
    for (std::size_t part = 0; part < surfaces_.size(); ++part)
        if (auto packed = pack_part(part)) messages.push_back(std::move(packed));
    return messages;
}

std::pair<Status, std::string> Bridge::status() const {
    const viewer::Snapshot& shown = hub_.shown();
    if (!shown.report.finite) return {Status::Failed, "stopped: " + shown.report.failure};
    return {Status::Ok, shown.status.paused ? "paused" : "running"};
}

std::string Bridge::state() const {
    const viewer::Snapshot& shown = hub_.shown();
    const StepReport& report = shown.report;
    const nlohmann::ordered_json state{{"time_s", report.time_s},
                                       {"step", report.step},
                                       {"run", shown.run},
                                       {"pace", shown.pace},
                                       {"insertion_mm", 1e3 * report.insertion_m},
                                       {"rotation_rad", report.rotation_rad},
                                       {"contact_force_n", report.contact_force_n},
                                       {"max_contact_force_n", report.max_contact_force_n},
                                       {"handle_force_n", report.handle_force_n},
                                       {"lumen_exits", report.lumen_exits}};
    return state.dump();
}

} // namespace trocar::engine::igtl
