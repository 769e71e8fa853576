// Access control: a random token in the address, the machine's own name in Host, and no page of another site behind the
// request (browsers say so in Origin).
#pragma once

#include "base/result.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace trocar::engine::viewer {

/// 32 hexadecimal digits from the operating system's random source.
[[nodiscard]] Result<std::string> make_token();

/// "/path?token=x&saved=3": its parts, empty where they are missing; 0 where what is asked for is no number.
struct RequestTarget {
    std::string path, token;
    std::uint32_t saved = 0; // SavedMark::id
};
[[nodiscard]] RequestTarget split_target(std::string_view target);

class Gate {
public:
    /// loopback  the server listens on this machine only: other names in Host come from DNS rebinding
    Gate(std::string token, unsigned short port, bool loopback) : token_(std::move(token)), port_(port), loopback_(loopback) {}

    [[nodiscard]] const std::string& token() const noexcept { return token_; }
    /// Constant-time comparison of the token.
    [[nodiscard]] bool knows(std::string_view token) const noexcept;
    [[nodiscard]] bool accepts_host(std::string_view host) const;
    /// origin  empty: not sent, so no browser asks
    [[nodiscard]] bool accepts_origin(std::string_view origin, std::string_view host) const;

private:
    std::string token_;
    unsigned short port_;
    bool loopback_;
};

} // namespace trocar::engine::viewer
