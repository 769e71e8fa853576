// A port that is listened at, by the page's server and by what is served beside it.
#pragma once

#include "base/result.hpp"

#include <boost/asio/ip/tcp.hpp>

#include <string>

namespace trocar::engine::viewer {

/// option  of the command line that gave the port, as errors name it
/// fails   BadUsage: the address is none, or the port is taken
[[nodiscard]] Result<void> listen_at(boost::asio::ip::tcp::acceptor& acceptor, const std::string& address, unsigned short port, const char* option);

} // namespace trocar::engine::viewer
