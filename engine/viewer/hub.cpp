#include "engine/viewer/hub.hpp"

#include "engine/state/state_bytes.hpp"
#include "engine/step/checkpoint.hpp"
#include "engine/step/model_hash.hpp"
#include "engine/time/clock.hpp"
#include "engine/viewer/far_triangles.hpp"

#include <fmt/format.h>

namespace trocar::engine::viewer {

namespace {

/// ns between two polls of the simulation: half of an input's longest wait.
constexpr std::chrono::milliseconds kTick{2};
/// ns between two frames at least: about 65 a second, a little more than screens show. One that shows what a command did goes at once, as
/// often as that in between.
constexpr std::int64_t kFrameInterval = 15'000'000;
/// ns; where all look at the X-ray monitor, whose pictures are its own.
constexpr std::int64_t kXrayFrameInterval = 60'000'000;
/// ns; a drive command that was not repeated for so long ends: its page hangs, or its connection does.
constexpr std::int64_t kDriveTimeout = 600'000'000;
/// Until the next try where a connection could not be accepted.
constexpr std::chrono::milliseconds kAcceptAgain{100};
/// Triangles of a surface as seen from afar: a page without a graphics card draws some ten thousand in 5 ms. A vessel's branches want more.
constexpr std::size_t kFarVessel = 6000, kFarBody = 2000;

} // namespace

Hub::Hub(const Scene& scene, const PreparedScene& prepared, const Session& session, Exchange& exchange, std::string page)
    : scene_(scene), model_(prepared.model), exchange_(exchange), page_(std::move(page)), range_(range_of(prepared.model)), monitor_(scene, prepared.model, exchange),
      picker_(prepared.model), saver_(scene) {
    scene_text_ = std::make_shared<const std::string>(scene_message(scene, prepared, session, picker_.places()));
    for (const EffectDescriptor* effect : registered_effects())
        if (!session.permits(*effect)) range_.missing.push_back(effect);
    std::size_t part = 0;
    for (const BodyModel& body : prepared.model.bodies) {
        const std::vector<Triangle> far = body.is_free_space ? std::vector<Triangle>() : far_triangles(body.surface, body.hollow ? kFarVessel : kFarBody);
        model_messages_.push_back(std::make_shared<const std::string>(encode_model(part++, body.is_free_space ? std::vector<Triangle>() : body.surface.triangles, far)));
    }
    for (const InstrumentModel& instrument : prepared.model.instruments)
        model_messages_.push_back(std::make_shared<const std::string>(encode_model(part++, instrument.skin.triangles)));
}

void Hub::start_ticking() {
    timer_.expires_after(kTick);
    timer_.async_wait([this](const boost::system::error_code& failed) {
        if (failed) return;
        tick();
        start_ticking();
    });
}

void Hub::accept_from(Tcp::acceptor& acceptor) {
    acceptor.async_accept([this, &acceptor](const boost::system::error_code& failed, Tcp::socket socket) {
        if (failed == boost::asio::error::operation_aborted) return;
        if (failed) { // out of descriptors, say
            pause_.expires_after(kAcceptAgain);
            return pause_.async_wait([this, &acceptor](const boost::system::error_code& stopped) {
                if (!stopped) accept_from(acceptor);
            });
        }
        if (connections_ < kMostConnections || drop_newcomer()) serve_connection(*this, std::move(socket)); // else it is closed
        accept_from(acceptor);
    });
}

void Hub::add_newcomer(std::weak_ptr<Newcomer> newcomer) {
    if (newcomers_.size() >= 2 * kMostConnections) std::erase_if(newcomers_, [](const auto& one) { return one.expired(); });
    newcomers_.push_back(std::move(newcomer));
}

bool Hub::drop_newcomer() {
    while (!newcomers_.empty()) {
        const auto oldest = newcomers_.front().lock();
        newcomers_.pop_front();
        if (oldest != nullptr && oldest->give_up()) return true;
    }
    return false;
}

std::shared_ptr<void> Hub::count_connection() {
    ++connections_;
    return {nullptr, [this](void*) { --connections_; }};
}

void Hub::tick() {
    const std::int64_t now = monotonic_ns();
    plot_.take(exchange_);
    answer_sealed();
    answer_saved();
    check_driver(now);
    take_snapshot(now);
    take_xray();
}

void Hub::take_xray() {
    auto picture = monitor_.take();
    if (picture == nullptr) return;
    xray_ = std::move(picture);
    for (const auto& [number, weak] : clients_)
        if (const auto client = weak.lock(); client != nullptr && client->wants_xray()) client->xray_is_due();
}

/// Only what can be sent to a viewer now: the simulation copies the next one when this one was taken.
void Hub::take_snapshot(std::int64_t now) {
    const std::uint64_t answers = exchange_.answers.load(std::memory_order_acquire);
    const bool early = now - last_frame_ns_ < (all_see_xray_ ? kXrayFrameInterval : kFrameInterval);
    if (early && (answers == answers_shown_ || now - last_answer_ns_ < kFrameInterval)) return;
    bool ready = false;
    for (const auto& [number, weak] : clients_)
        if (const auto client = weak.lock()) ready = ready || client->is_idle();
    if (!ready || !exchange_.snapshot.take()) return;
    last_frame_ns_ = now;
    answers_shown_ = answers;
    if (early) last_answer_ns_ = now;
    frames_.add(exchange_.snapshot.front());
    for (const auto& [number, weak] : clients_)
        if (const auto client = weak.lock()) client->frame_is_due();
}

void Hub::answer_sealed() {
    exchange_.sealed.consume_all([this](const Sealed& sealed) {
        const OnSealed on_sealed = std::move(waiting_.front());
        waiting_.pop_front();
        on_sealed(sealed);
    });
}

bool Hub::ask_for(const Seal& what, OnSealed on_sealed) {
    if (waiting_.size() >= kMostSeals || !exchange_.commands.push(what)) return false;
    waiting_.push_back(std::move(on_sealed));
    return true;
}

std::string Hub::checkpoint_of(const Saved& saved) const {
    Checkpoint checkpoint{hash_model(model_), model_.name, saved.status.budget, saved.mark.step, {}};
    append_state(*saved.state, checkpoint.state);
    return checkpoint_bytes(checkpoint);
}

void Hub::stop_drive() {
    drive_moves_ = false;
    stop_is_due_ = !exchange_.commands.push(Drive{}); // full: at the next tick
}

void Hub::let_tissue_go() { let_go_is_due_ = !exchange_.commands.push(LetGo{}); }

void Hub::empty_seat() {
    driver_ = 0;
    stop_drive();
    let_tissue_go();
}

void Hub::check_driver(std::int64_t now) {
    if (stop_is_due_ || (drive_moves_ && now - last_drive_ns_ > kDriveTimeout)) stop_drive();
    if (let_go_is_due_) let_tissue_go();
}

unsigned Hub::join(const std::shared_ptr<Viewer>& client) {
    const unsigned number = next_client_++;
    clients_[number] = client;
    if (driver_ == 0) driver_ = number;
    if (exchange_.snapshot.take()) frames_.add(exchange_.snapshot.front()); // of before: nothing was copied while nobody watched
    update_wishes();
    exchange_.joined.fetch_add(1, std::memory_order_release);
    return number;
}

void Hub::leave(unsigned client) {
    clients_.erase(client);
    if (driver_ == client) empty_seat();
    update_wishes();
}

void Hub::update_wishes() {
    bool spheres = false, xray = false, surfaces = false;
    for (const auto& [number, weak] : clients_)
        if (const auto client = weak.lock()) {
            spheres = spheres || client->wants_spheres();
            (client->wants_xray() ? xray : surfaces) = true;
        }
    all_see_xray_ = xray && !surfaces;
    if (!xray) xray_ = nullptr; // it gets old
    exchange_.xray_wanted.store(xray, std::memory_order_relaxed);
    monitor_.show(xray);
    exchange_.spheres.store(spheres, std::memory_order_relaxed);
    exchange_.viewers.store(static_cast<unsigned>(clients_.size()), std::memory_order_relaxed);
}

std::string Hub::handle(unsigned client, const Request& request) {
    const auto refusal = [](const std::string& sentence) { return sentence.empty() ? std::string() : error_message(sentence); };
    if (const auto* asked = std::get_if<Command>(&request)) return refusal(submit(client, *asked));
    if (const auto* show = std::get_if<ShowSpheres>(&request)) {
        if (const auto asking = clients_[client].lock()) asking->show_spheres(show->on);
        update_wishes();
    } else if (const auto* xray = std::get_if<ShowXray>(&request)) {
        if (const auto asking = clients_[client].lock()) {
            asking->show_xray(xray->on);
            if (xray->on && xray_ != nullptr) asking->xray_is_due(); // what the others see
        }
        update_wishes();
    } else if (const auto* set = std::get_if<SetXray>(&request)) {
        if (const std::string refused = refuse(client); !refused.empty()) return error_message(refused);
        monitor_.set(set->settings);
    } else if (std::holds_alternative<TakeMask>(request)) {
        if (const std::string refused = refuse(client); !refused.empty()) return error_message(refused);
        monitor_.take_mask();
    } else if (std::holds_alternative<PickPlace>(request) || std::holds_alternative<ForgetPicks>(request) || std::holds_alternative<SaveScene>(request)) {
        return refusal(handle_pick(client, request));
    } else if (std::holds_alternative<TakeSeat>(request)) {
        if (const std::string refused = take_seat(client); !refused.empty()) return notice_message(refused);
    } else if (std::holds_alternative<LeaveSeat>(request)) {
        leave_seat(client);
    } else if (const auto* ping = std::get_if<Ping>(&request))
        return pong_message(ping->number);
    return {};
}

std::string Hub::refuse(unsigned client) const {
    if (driver_ == client) return {};
    return driver_ == 0 ? "nobody drives: take the seat first" : fmt::format("viewer {} drives; you watch", driver_);
}

std::string Hub::take_seat(unsigned client) {
    if (driver_ != 0 && driver_ != client) return fmt::format("viewer {} drives; the seat is free when they leave it", driver_);
    driver_ = client;
    return {};
}

void Hub::leave_seat(unsigned client) {
    if (driver_ == client) empty_seat();
}

std::string Hub::submit(unsigned client, const Command& command, bool lasts) {
    if (std::string refused = refuse(client); !refused.empty()) return refused;
    if (!exchange_.commands.push(command)) return "too many commands wait for the next step; this one is dropped";
    if (const auto* drive = std::get_if<Drive>(&command)) {
        drive_moves_ = !lasts && (drive->insertion != 0.0 || drive->rotation != 0.0);
        last_drive_ns_ = monotonic_ns();
    }
    return {};
}

std::string Hub::status_for(unsigned client, std::uint64_t& plot_cursor) const {
    return status_message(exchange_.snapshot.front(), frames_.latest(), {client, driver_, clients_.size()}, plot_,
                          exchange_.steps_not_shown.load(std::memory_order_relaxed), plot_cursor);
}

} // namespace trocar::engine::viewer
