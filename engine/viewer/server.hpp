// The page's server: HTTP for the page and for recordings, a WebSocket for the run. One thread of its own; viewers that are
// slow get fewer frames, and none is waited for.
#pragma once

#include "engine/viewer/loop.hpp"

#include <functional>
#include <memory>
#include <string>

namespace trocar::engine::viewer {

class Hub;

struct ServerOptions {
    std::string address = "127.0.0.1";
    unsigned short port = 0; // 0: a free one
    std::string page;        // HTML
    bool serves_page = true; // false: nothing listens at the port
    /// Another protocol for the same run, on the same thread; what it gives is kept as long as the server.
    std::function<Result<std::shared_ptr<void>>(Hub&)> beside{};
};

class Server {
public:
    /// Listens, and serves from a thread of its own until it is destroyed. session: only what never changes is read.
    /// fails  BadUsage: the address is none, or the port is taken
    [[nodiscard]] static Result<std::unique_ptr<Server>> open(const Scene& scene, const PreparedScene& prepared, const Session& session,
                                                              Exchange& exchange, const ServerOptions& options);
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    /// Empty without a page.
    [[nodiscard]] const std::string& url() const noexcept;
    [[nodiscard]] unsigned short port() const noexcept;
    [[nodiscard]] const std::string& token() const noexcept;

private:
    struct Parts;
    explicit Server(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> parts_;
};

} // namespace trocar::engine::viewer
