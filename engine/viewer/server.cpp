#include "engine/viewer/server.hpp"

#include "engine/viewer/hub.hpp"

#include <fmt/format.h>

#include <thread>

namespace trocar::engine::viewer {

using Tcp = boost::asio::ip::tcp;

struct Server::Parts {
    Hub hub;
    Tcp::acceptor acceptor;
    std::string url;
    unsigned short port = 0;
    std::thread thread;

    Parts(const Scene& scene, const PreparedScene& prepared, const Session& session, Exchange& exchange, const std::string& page)
        : hub(scene, prepared, session, exchange, page), acceptor(hub.io()) {}
};

namespace {

Error refuse(const ServerOptions& options, const boost::system::error_code& why) {
    return {ErrorCode::BadUsage,
            fmt::format("cannot listen at {} port {}: {}", options.address, options.port, why.message()),
            {},
            0,
            0,
            "--port"};
}

boost::system::error_code listen(Tcp::acceptor& acceptor, const Tcp::endpoint& at) {
    boost::system::error_code failed;
    acceptor.open(at.protocol(), failed);
    if (!failed) acceptor.set_option(Tcp::acceptor::reuse_address(true), failed);
    if (!failed) acceptor.bind(at, failed);
    if (!failed) acceptor.listen(Tcp::acceptor::max_listen_connections, failed);
    return failed;
}

} // namespace

Server::Server(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

Server::~Server() {
    parts_->hub.io().stop();
    if (parts_->thread.joinable()) parts_->thread.join();
}

Result<std::unique_ptr<Server>> Server::open(const Scene& scene, const PreparedScene& prepared, const Session& session, Exchange& exchange,
                                             const ServerOptions& options) {
    auto token = make_token();
    if (!token.ok()) return token.error();
    boost::system::error_code failed;
    const auto address = boost::asio::ip::make_address(options.address, failed);
    if (failed)
        return Error{ErrorCode::BadUsage,
                     fmt::format("\"{:.60}\" is no address; expected 127.0.0.1, which only this machine reaches", options.address),
                     {},
                     0,
                     0,
                     "--address"};
    auto parts = std::make_unique<Parts>(scene, prepared, session, exchange, options.page);
    if (const auto refused = listen(parts->acceptor, {address, options.port})) return refuse(options, refused);
    parts->port = parts->acceptor.local_endpoint().port();
    const std::string host = address.is_v6() ? fmt::format("[{}]", options.address) : options.address;
    parts->url = fmt::format("http://{}:{}/?token={}", host, parts->port, *token);
    parts->hub.set_gate(Gate(*token, parts->port, address.is_loopback()));
    parts->hub.start_ticking();
    parts->hub.accept_from(parts->acceptor);
    parts->thread = std::thread([hub = &parts->hub] { hub->io().run(); });
    return std::unique_ptr<Server>(new Server(std::move(parts)));
}

const std::string& Server::url() const noexcept { return parts_->url; }
unsigned short Server::port() const noexcept { return parts_->port; }
const std::string& Server::token() const noexcept { return parts_->hub.gate().token(); }

} // namespace trocar::engine::viewer
