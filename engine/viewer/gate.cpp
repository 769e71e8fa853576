#include "engine/viewer/gate.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>

#include <sys/random.h>

namespace trocar::engine::viewer {

Result<std::string> make_token() {
    std::array<unsigned char, 16> bytes{};
    if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
        return Error{ErrorCode::ToolFailed, "the operating system gave no random bytes for the page's token"};
    std::string token;
    for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
    return token;
}

namespace {

std::uint32_t number_of(std::string_view text) noexcept {
    std::uint32_t number = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), number);
    return wrong == std::errc{} && end == text.data() + text.size() ? number : 0;
}

} // namespace

RequestTarget split_target(std::string_view target) {
    RequestTarget out;
    const std::size_t mark = target.find('?');
    out.path = std::string(target.substr(0, mark));
    if (mark == target.npos) return out;
    for (std::string_view rest = target.substr(mark + 1); !rest.empty();) {
        const std::string_view pair = rest.substr(0, rest.find('&'));
        if (pair.starts_with("token=")) out.token = std::string(pair.substr(6));
        if (pair.starts_with("saved=")) out.saved = number_of(pair.substr(6));
        rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    }
    return out;
}

bool Gate::knows(std::string_view token) const noexcept {
    if (token.size() != token_.size()) return false;
    unsigned char difference = 0;
    for (std::size_t k = 0; k < token.size(); ++k) difference |= static_cast<unsigned char>(token[k] ^ token_[k]);
    return difference == 0;
}

bool Gate::accepts_host(std::string_view host) const {
    if (!loopback_) return !host.empty();
    for (const char* name : {"127.0.0.1", "localhost", "[::1]"})
        if (host == fmt::format("{}:{}", name, port_) || (port_ == 80 && host == name)) return true;
    return false;
}

bool Gate::accepts_origin(std::string_view origin, std::string_view host) const {
    return origin.empty() || origin == fmt::format("http://{}", host);
}

} // namespace trocar::engine::viewer
