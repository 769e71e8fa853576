// A running view for 3D Slicer and other programs that speak OpenIGTLink (docs/igtl.md): they connect to a port, get surfaces, tips and
// state, and send drive commands. It lives on the thread of the viewer's server, and its clients are viewers beside the page's: one
// drives, the simulation waits for none, and a client that reads slowly gets fewer frames.
#pragma once

#include "engine/igtl/codec.hpp"
#include "engine/igtl/devices.hpp"
#include "engine/viewer/hub.hpp"

#include <functional>
#include <set>

namespace trocar::engine::igtl {

struct BridgeOptions {
    std::string address = "127.0.0.1";
    unsigned short port = 0; // 0: a free one
    double rate = 20.0;      // frames a second at most, of each client
    /// Gets a sentence about a client, each kind of it once. On the server's thread.
    std::function<void(const std::string&)> say{};
    /// Gets the port before the first client comes.
    std::function<void(unsigned short)> listens{};
};

/// Frames a second that may be asked for.
inline constexpr double kLeastRate = 1.0, kMostRate = 60.0;
/// Clients at the same time; a further one is closed.
inline constexpr std::size_t kMostClients = 16;

/// What is told once in a run.
enum class Complaint { TooMany, NoMessage, BadChecksum, TooLong, Unknown, Refused, NotRead };

class Bridge : public std::enable_shared_from_this<Bridge> {
public:
    using Tcp = viewer::Hub::Tcp;
    using Packed = std::shared_ptr<const std::string>;

    /// model  must outlive it
    /// fails  MissingTool: the program was built without the library; BadUsage: the address is none, or the port is taken
    [[nodiscard]] static Result<std::shared_ptr<void>> open(viewer::Hub& hub, const SceneModel& model, const BridgeOptions& options);

    Bridge(viewer::Hub& hub, const SceneModel& model, const BridgeOptions& options);

    [[nodiscard]] viewer::Hub& hub() noexcept { return hub_; }
    [[nodiscard]] const SceneModel& model() const noexcept { return model_; }
    [[nodiscard]] const Devices& devices() const noexcept { return devices_; }
    [[nodiscard]] std::int64_t interval_ns() const noexcept { return interval_ns_; }

    /// Of the latest frame: tips, state, the surfaces that move. Packed once for all clients.
    [[nodiscard]] const std::vector<Packed>& frame();
    /// Every surface as the latest frame has it, and who is who.
    [[nodiscard]] std::vector<Packed> scene();
    /// running, paused, or why it stopped.
    [[nodiscard]] std::pair<Status, std::string> status() const;
    /// Simulated, of the latest frame.
    [[nodiscard]] double time_s() const noexcept { return hub_.shown().report.time_s; }

    void complain(Complaint about, const std::string& sentence);
    void count_client(int change) noexcept { clients_ += static_cast<std::size_t>(change); }

private:
    void accept();
    [[nodiscard]] Packed pack_part(std::size_t part);
    [[nodiscard]] std::string state() const;

    viewer::Hub& hub_;
    const SceneModel& model_;
    BridgeOptions options_;
    Devices devices_;
    std::int64_t interval_ns_;
    std::vector<Packed> surfaces_;         // [part] as last packed; null: not yet, or it has no triangle
    std::vector<std::uint32_t> packed_of_; // [part] the frame that that was
    std::vector<Packed> frame_;
    std::uint32_t frame_id_ = 0; // that frame_ is of; 0: none
    std::set<Complaint> told_;
    std::size_t clients_ = 0;
    Tcp::acceptor acceptor_;
    boost::asio::steady_timer pause_;
};

/// Serves a connection that has just been accepted.
void serve_client(std::shared_ptr<Bridge> bridge, Bridge::Tcp::socket socket);

} // namespace trocar::engine::igtl
