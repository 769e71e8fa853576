// A scene that is served, and viewers that speak to it: everything with limits of time that decide nothing but how long a
// test waits before it fails.
#pragma once

#include "../engine/step_fixture.hpp"

#include "engine/viewer/server.hpp"

#include <boost/asio/connect.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <nlohmann/json.hpp>

#include <chrono>
#include <functional>
#include <optional>
#include <thread>

namespace trocar::engine::viewer::test {

namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using Tcp = boost::asio::ip::tcp;
using Json = nlohmann::json;

inline constexpr std::chrono::seconds kPatience{60}; // far more than anything takes, also on a busy machine

/// A wire in a bent tube, served until it goes out of scope.
struct Live {
    Scene scene;
    PreparedScene prepared;
    std::optional<Session> session;
    Exchange exchange;
    std::unique_ptr<Server> server;
    RunStatistics tally;
    LoopOptions options;
    std::thread thread;

    explicit Live(const std::string& text = engine::test::bent_tube_scene({35, "work:20000"}), const LoopOptions& loop = {})
        : options(loop) {
        scene = *parse_scene(text, "scenes/live.json");
        prepared = *make_prepared_scene(scene);
        start();
    }
    Live(const Scene& read, const PreparedScene& made) : scene(read), prepared(made) { start(); }
    void start() {
        session.emplace(scene, prepared);
        open_exchange(*session, exchange);
        auto opened = Server::open(scene, prepared, *session, exchange, {"127.0.0.1", 0, "<!doctype html><title>page</title>"});
        EXPECT_TRUE(opened.ok());
        server = std::move(*opened);
        thread = std::thread([this] { run_loop(*session, exchange, options, tally); });
    }
    void stop() {
        exchange.stop = true;
        if (thread.joinable()) thread.join();
        server.reset();
    }
    ~Live() { stop(); }
};

struct Answer {
    unsigned status = 0;
    std::string body;
    http::response<http::string_body> response;
};

/// One HTTP request. headers  beside Host
inline Answer get(const Live& live, const std::string& target, const std::map<std::string, std::string>& headers = {},
                  http::verb verb = http::verb::get) {
    boost::asio::io_context io;
    beast::tcp_stream stream(io);
    Answer answer;
    stream.connect(Tcp::endpoint(boost::asio::ip::make_address("127.0.0.1"), live.server->port()));
    http::request<http::string_body> request(verb, target, 11);
    request.set(http::field::host, fmt::format("127.0.0.1:{}", live.server->port()));
    for (const auto& [name, value] : headers) request.set(name, value);
    http::write(stream, request);
    beast::flat_buffer buffer;
    http::response_parser<http::string_body> parser;
    parser.body_limit(64 * 1024 * 1024);
    parser.skip(verb == http::verb::head);
    beast::error_code failed;
    http::read(stream, buffer, parser, failed);
    answer.response = parser.release();
    answer.status = answer.response.result_int();
    answer.body = answer.response.body();
    return answer;
}

/// A viewer. Reads when asked to.
class Viewer {
public:
    /// receive_buffer  bytes that the system keeps for it; 0: as usual
    explicit Viewer(const Live& live, const std::string& origin = {}, int receive_buffer = 0) : stream_(io_) {
        stream_.read_message_max(64 * 1024 * 1024);
        Tcp::socket& socket = beast::get_lowest_layer(stream_).socket();
        socket.open(Tcp::v4());
        if (receive_buffer > 0) socket.set_option(boost::asio::socket_base::receive_buffer_size(receive_buffer));
        socket.connect(Tcp::endpoint(boost::asio::ip::make_address("127.0.0.1"), live.server->port()));
        stream_.set_option(websocket::stream_base::decorator([origin](websocket::request_type& request) {
            if (!origin.empty()) request.set(http::field::origin, origin);
        }));
        stream_.handshake(fmt::format("127.0.0.1:{}", live.server->port()), "/ws?token=" + live.server->token());
    }

    void send(const std::string& text) { stream_.write(boost::asio::buffer(text)); }
    void send_bytes(const std::string& bytes) {
        stream_.binary(true);
        stream_.write(boost::asio::buffer(bytes));
        stream_.binary(false);
    }

    /// The next message; nothing when the connection ended, or none came.
    std::optional<std::string> read() {
        std::optional<std::string> message;
        bool over = false;
        buffer_.consume(buffer_.size());
        stream_.async_read(buffer_, [&](beast::error_code failed, std::size_t) {
            over = true;
            ended_ = failed;
            if (!failed) message = beast::buffers_to_string(buffer_.data());
        });
        io_.restart();
        io_.run_for(kPatience);
        if (!over) { // give up: the handler must not outlive this call
            beast::get_lowest_layer(stream_).socket().close();
            io_.restart();
            io_.run();
        }
        was_text_ = stream_.got_text();
        return message;
    }
    [[nodiscard]] bool was_text() const noexcept { return was_text_; }
    [[nodiscard]] beast::error_code ended() const noexcept { return ended_; }
    [[nodiscard]] websocket::close_reason reason() const { return stream_.reason(); }

    /// Reads on to a text that `good` accepts; null when none comes.
    Json await(const std::function<bool(const Json&)>& good) {
        const auto end = std::chrono::steady_clock::now() + kPatience;
        while (std::chrono::steady_clock::now() < end) {
            const auto message = read();
            if (!message) return {};
            if (!was_text_) {
                ++binary_messages;
                continue;
            }
            Json json = Json::parse(*message, nullptr, false);
            EXPECT_FALSE(json.is_discarded()) << *message;
            if (good(json)) return json;
        }
        return {};
    }
    Json await_type(const std::string& type) {
        return await([&](const Json& json) { return json["type"] == type; });
    }
    Json await_status(const std::function<bool(const Json&)>& good) {
        return await([&](const Json& json) { return json["type"] == "status" && good(json); });
    }

    std::size_t binary_messages = 0;

private:
    boost::asio::io_context io_;
    websocket::stream<beast::tcp_stream> stream_;
    beast::flat_buffer buffer_;
    beast::error_code ended_;
    bool was_text_ = false;
};

} // namespace trocar::engine::viewer::test
