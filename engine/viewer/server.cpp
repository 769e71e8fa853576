#include "engine/viewer/server.hpp"

#include "engine/viewer/hub.hpp"
#include "engine/viewer/listen.hpp"

#include <fmt/format.h>

#include <thread>

namespace trocar::engine::viewer {

using Tcp = boost::asio::ip::tcp;

struct Server::Parts {
    Hub hub;
    Tcp::acceptor acceptor;
    std::shared_ptr<void> beside;
    std::string url;
    unsigned short port = 0;
    std::thread thread;

    Parts(const Scene& scene, const PreparedScene& prepared, const Session& session, Exchange& exchange, const std::string& page)
        : hub(scene, prepared, session, exchange, page), acceptor(hub.io()) {}
};

Server::Server(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

Server::~Server() {
    parts_->hub.io().stop();
    if (parts_->thread.joinable()) parts_->thread.join();
}

Result<std::unique_ptr<Server>> Server::open(const Scene& scene, const PreparedScene& prepared, const Session& session, Exchange& exchange,
                                             const ServerOptions& options) {
    auto token = make_token();
    if (!token.ok()) return token.error();
    auto parts = std::make_unique<Parts>(scene, prepared, session, exchange, options.page);
    if (options.serves_page) {
        if (const auto listens = listen_at(parts->acceptor, options.address, options.port, "--port"); !listens.ok()) return listens.error();
        const auto address = parts->acceptor.local_endpoint().address();
        parts->port = parts->acceptor.local_endpoint().port();
        const std::string host = address.is_v6() ? fmt::format("[{}]", options.address) : options.address;
        parts->url = fmt::format("http://{}:{}/?token={}", host, parts->port, *token);
        parts->hub.set_gate(Gate(*token, parts->port, address.is_loopback()));
        parts->hub.accept_from(parts->acceptor);
    }
    if (options.beside) {
        auto beside = options.beside(parts->hub);
        if (!beside.ok()) return beside.error();
        parts->beside = std::move(*beside);
    }
    parts->hub.start_ticking();
    parts->thread = std::thread([hub = &parts->hub] { hub->io().run(); });
    return std::unique_ptr<Server>(new Server(std::move(parts)));
}

const std::string& Server::url() const noexcept { return parts_->url; }
unsigned short Server::port() const noexcept { return parts_->port; }
const std::string& Server::token() const noexcept { return parts_->hub.gate().token(); }

} // namespace trocar::engine::viewer
