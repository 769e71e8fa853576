// State shared by all connections, on the network's thread: the latest frames, the driving viewer, pending recordings.
#pragma once

#include "engine/viewer/frame.hpp"
#include "engine/viewer/gate.hpp"
#include "engine/viewer/messages.hpp"
#include "engine/viewer/place_messages.hpp"
#include "engine/viewer/scene_saver.hpp"
#include "engine/viewer/xray_monitor.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace trocar::engine::viewer {

/// A connection that has not sent its request yet.
class Newcomer {
public:
    virtual ~Newcomer() = default;
    /// Closes it in favour of another. False: its request has come.
    virtual bool give_up() = 0;
};

/// A connection that has joined.
class Viewer {
public:
    virtual ~Viewer() = default;
    /// It can be sent a frame now.
    [[nodiscard]] virtual bool is_idle() const noexcept = 0;
    [[nodiscard]] virtual bool wants_spheres() const noexcept = 0;
    virtual void show_spheres(bool on) noexcept = 0;
    [[nodiscard]] virtual bool wants_xray() const noexcept = 0;
    virtual void show_xray(bool on) noexcept = 0;
    /// There is a new picture of the X-ray monitor.
    virtual void xray_is_due() = 0;
    /// There is a new one.
    virtual void frame_is_due() = 0;
    /// A text message for a page; others have nowhere to show it.
    virtual void tell(const std::string& /*message*/) {}
};

/// Connections at the same time: HTTP and WebSocket together, and viewers among them.
inline constexpr std::size_t kMostConnections = 96, kMostViewers = 64;

class Hub {
public:
    using Tcp = boost::asio::ip::tcp;
    using OnSealed = std::function<void(const Sealed&)>;

    Hub(const Scene& scene, const PreparedScene& prepared, const Session& session, Exchange& exchange, std::string page);
    ~Hub() { waiting_.clear(); } // connections need io_
    Hub(const Hub&) = delete;
    Hub& operator=(const Hub&) = delete;

    /// Polls the simulation a few hundred times a second, until stopped.
    void start_ticking();
    void accept_from(Tcp::acceptor& acceptor);
    [[nodiscard]] boost::asio::io_context& io() noexcept { return io_; }

    void set_gate(Gate gate) { gate_ = std::move(gate); }
    [[nodiscard]] const Gate& gate() const noexcept { return gate_; }
    [[nodiscard]] const std::string& page() const noexcept { return page_; }
    [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
    [[nodiscard]] const CommandRange& range() const noexcept { return range_; }
    [[nodiscard]] FrameStore& frames() noexcept { return frames_; }
    /// The snapshot that the latest frame was made of; before the first frame the surfaces at the start.
    [[nodiscard]] const Snapshot& shown() const noexcept { return exchange_.snapshot.front(); }
    /// The X-ray monitor's last picture; nullptr: none yet.
    [[nodiscard]] const std::shared_ptr<const std::string>& xray() const noexcept { return xray_; }
    [[nodiscard]] bool has_free_place() const noexcept { return clients_.size() < kMostViewers; }

    /// A viewer has come; its number. The first one drives. A frame that shows the session as it is now will be due.
    unsigned join(const std::shared_ptr<Viewer>& client);
    void leave(unsigned client);
    /// Text of the answer; empty: none is due.
    [[nodiscard]] std::string handle(unsigned client, const Request& request);
    /// Passes a command on. The sentence that refuses it; empty: it was taken.
    /// lasts  a drive command ends with the next one, or with its viewer; else it ends unless it is repeated
    [[nodiscard]] std::string submit(unsigned client, const Command& command, bool lasts = false);
    /// The same for the driver's seat.
    [[nodiscard]] std::string take_seat(unsigned client);
    void leave_seat(unsigned client);
    /// What a newcomer gets first.
    [[nodiscard]] const std::vector<std::shared_ptr<const std::string>>& model_messages() const noexcept { return model_messages_; }
    [[nodiscard]] const std::shared_ptr<const std::string>& scene_text() const noexcept { return scene_text_; }
    /// What is picked, as a message.
    [[nodiscard]] std::string picks_text() const { return picks_message(picker_.picks(), model_); }
    /// Status to go with the latest frame.
    [[nodiscard]] std::string status_for(unsigned client, std::uint64_t& plot_cursor) const;
    [[nodiscard]] std::uint64_t plot_begin() const noexcept { return plot_.end(); }

    /// Calls back with the recording as it stands, or with a saved state; false: too much is waiting.
    [[nodiscard]] bool ask_for(const Seal& what, OnSealed on_sealed);
    /// As a file that `trocar run --resume` goes on from (checkpoint.hpp).
    [[nodiscard]] std::string checkpoint_of(const Saved& saved) const;

    /// Counts a connection for as long as it is kept.
    [[nodiscard]] std::shared_ptr<void> count_connection();
    /// Where all places are taken the oldest idle one is closed: open connections lock no other out.
    void add_newcomer(std::weak_ptr<Newcomer> newcomer);
    void update_wishes();

private:
    void tick();
    void take_snapshot(std::int64_t now);
    void take_xray();
    void answer_sealed();
    void answer_saved();
    [[nodiscard]] std::string handle_pick(unsigned client, const Request& request);
    void tell_picks();
    void check_driver(std::int64_t now);
    /// The sentence that says who drives; empty: this viewer.
    [[nodiscard]] std::string refuse(unsigned client) const;
    void stop_drive();
    void let_tissue_go();
    void empty_seat();
    [[nodiscard]] bool drop_newcomer();

    const Scene& scene_;
    const SceneModel& model_; // as prepared
    Exchange& exchange_;
    std::string page_;
    Gate gate_{"", 0, true};
    CommandRange range_;
    FrameStore frames_;
    XrayMonitor monitor_;
    Picker picker_;
    SceneSaver saver_;
    std::shared_ptr<const std::string> xray_; // its last picture
    PlotHistory plot_;
    std::shared_ptr<const std::string> scene_text_;
    std::vector<std::shared_ptr<const std::string>> model_messages_;
    std::map<unsigned, std::weak_ptr<Viewer>> clients_;
    std::deque<OnSealed> waiting_; // for answers to Seal, which come in this order
    std::uint64_t answers_shown_ = 0;
    unsigned next_client_ = 1, driver_ = 0;
    std::size_t connections_ = 0;
    std::int64_t last_frame_ns_ = 0, last_drive_ns_ = 0, last_answer_ns_ = 0; // an answer: a frame before its time
    bool drive_moves_ = false, stop_is_due_ = false, let_go_is_due_ = false, all_see_xray_ = false;
    std::deque<std::weak_ptr<Newcomer>> newcomers_; // the oldest first
    boost::asio::io_context io_{1}; // goes before the rest: what waits in it still refers to that
    boost::asio::steady_timer timer_{io_}, pause_{io_};
};

/// Reads a request from a connection that has just been accepted.
void serve_connection(Hub& hub, Hub::Tcp::socket socket);

} // namespace trocar::engine::viewer
