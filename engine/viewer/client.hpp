// One viewer's WebSocket. One message is written at a time; answers wait in a short queue, frames in none: when the last
// one is through, the latest goes next.
#pragma once

#include "engine/viewer/hub.hpp"

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <deque>

namespace trocar::engine::viewer {

class Client final : public Viewer, public std::enable_shared_from_this<Client> {
public:
    using Upgrade = boost::beast::http::request<boost::beast::http::empty_body>;

    Client(Hub& hub, boost::beast::tcp_stream stream, std::shared_ptr<void> connection);
    ~Client() override;
    void start(const Upgrade& request);

    [[nodiscard]] bool is_idle() const noexcept override { return open_ && !writing_ && out_.empty(); }
    [[nodiscard]] bool wants_spheres() const noexcept override { return spheres_; }
    void show_spheres(bool on) noexcept override { spheres_ = on; }
    void frame_is_due() override;
    [[nodiscard]] bool wants_xray() const noexcept override { return xray_; }
    void show_xray(bool on) noexcept override { xray_ = on; }
    void xray_is_due() override;
    void tell(const std::string& message) override { say(message); }

private:
    struct Message {
        std::shared_ptr<const std::string> bytes;
        bool binary = false;
    };
    void greet();
    void read();
    void on_message(std::size_t size);
    void say(std::string text);
    void write_next();
    void write(Message message);
    void close(boost::beast::websocket::close_code code, const char* reason);

    Hub& hub_;
    boost::beast::websocket::stream<boost::beast::tcp_stream> stream_;
    std::shared_ptr<void> connection_;
    boost::beast::flat_buffer buffer_;
    std::deque<Message> out_;
    unsigned number_ = 0;         // 0: not joined
    std::uint32_t base_ = 0;      // the last frame written
    std::uint32_t status_of_ = 0; // the frame that was last written without its status yet
    std::uint64_t plot_cursor_ = 0;
    bool open_ = false, writing_ = false, frame_due_ = false, spheres_ = false, closing_ = false;
    bool xray_ = false, xray_due_ = false;
};

} // namespace trocar::engine::viewer
