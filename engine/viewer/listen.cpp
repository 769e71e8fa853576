#include "engine/viewer/listen.hpp"

#include <fmt/format.h>

namespace trocar::engine::viewer {

Result<void> listen_at(boost::asio::ip::tcp::acceptor& acceptor, const std::string& address, unsigned short port, const char* option) {
    using Tcp = boost::asio::ip::tcp;
    boost::system::error_code failed;
    const auto read = boost::asio::ip::make_address(address, failed);
    if (failed)
        return Error{ErrorCode::BadUsage,
                     fmt::format("\"{:.60}\" is no address; expected 127.0.0.1, which only this machine reaches", address),
                     {},
                     0,
                     0,
                     "--address"};
    const Tcp::endpoint at(read, port);
    acceptor.open(at.protocol(), failed);
    if (!failed) acceptor.set_option(Tcp::acceptor::reuse_address(true), failed);
    if (!failed) acceptor.bind(at, failed);
    if (!failed) acceptor.listen(Tcp::acceptor::max_listen_connections, failed);
    if (failed)
        return Error{ErrorCode::BadUsage, fmt::format("cannot listen at {} port {}: {}", address, port, failed.message()), {}, 0, 0, option};
    return {};
}

} // namespace trocar::engine::viewer
