#include "engine/io/scanner.hpp"

#include "engine/io/shown.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace trocar::engine {

void Scanner::skip_space(bool across_lines) noexcept {
    while (at_ != end_) {
        const char c = *at_;
        if (is_blank(c) || (across_lines && c == '\n')) {
            ++at_;
        } else if (comment_ != 0 && c == comment_) {
            const void* stop = std::memchr(at_, '\n', left());
            at_ = stop ? static_cast<const char*>(stop) : end_;
        } else if (continuation_ && c == '\\') {
            const char* next = at_ + 1;
            while (next != end_ && is_blank(*next)) ++next;
            if (next != end_ && *next != '\n') return; // a backslash within a line is a character like others
            at_ = next == end_ ? end_ : next + 1;
        } else {
            return;
        }
    }
}

void Scanner::skip_line() noexcept {
    const void* stop = left() == 0 ? nullptr : std::memchr(at_, '\n', left());
    at_ = stop ? static_cast<const char*>(stop) + 1 : end_;
}

std::string_view Scanner::rest_of_line() {
    skip_space(false);
    const char* start = at_;
    skip_line();
    const char* stop = at_;
    if (comment_ != 0) stop = std::find(start, stop, comment_);
    while (stop != start && (is_blank(stop[-1]) || stop[-1] == '\n')) --stop;
    return {start, static_cast<std::size_t>(stop - start)};
}

bool Scanner::start_token(const char* what) {
    if (error_) return false;
    skip_space(true);
    token_ = at_;
    if (at_ != end_) return true;
    return fail(ErrorCode::BadSyntax, fmt::format("the file ends where {} should stand", what));
}

bool Scanner::word(std::string_view& out, const char* what) {
    if (!start_token(what)) return false;
    const char* stop = token_end();
    out = {at_, static_cast<std::size_t>(stop - at_)};
    at_ = stop;
    return true;
}

std::string_view Scanner::peek_word() {
    skip_space(true);
    return {at_, static_cast<std::size_t>(token_end() - at_)};
}

bool Scanner::fail_number(const char* stop, const char* what, const char* kind) {
    return fail(ErrorCode::BadSyntax,
                fmt::format("'{}' is not {} where {} should stand", shown({token_, static_cast<std::size_t>(stop - token_)}), kind, what));
}

bool Scanner::real(double& out, const char* what) {
    if (!start_token(what)) return false;
    if (*at_ == '+' && end_ - at_ > 1 && at_[1] != '-') ++at_;
    const auto [stop, status] = std::from_chars(at_, end_, out);
    const bool ends = stop == end_ || is_blank(*stop) || *stop == '\n' || *stop == comment_or_newline();
    if (status == std::errc::invalid_argument || !ends) return fail_number(token_end(), what, "a number");
    if (status == std::errc::result_out_of_range) {
        // Too small for a double is zero, too large is infinity: the exponent's sign tells.
        const char* exponent = std::find_if(at_, stop, [](char c) { return c == 'e' || c == 'E'; });
        const bool small = exponent != stop ? stop - exponent > 1 && exponent[1] == '-' : *at_ == '0' || *at_ == '.';
        out = small ? 0.0 : std::numeric_limits<double>::infinity();
    }
    at_ = stop;
    return true;
}

bool Scanner::integer(std::int64_t& out, const char* what) {
    if (!start_token(what)) return false;
    if (*at_ == '+' && end_ - at_ > 1 && at_[1] != '-') ++at_;
    const auto [stop, status] = std::from_chars(at_, end_, out);
    const bool ends = stop == end_ || is_blank(*stop) || *stop == '\n' || *stop == comment_or_newline();
    if (status != std::errc{} || !ends) return fail_number(token_end(), what, "an integer");
    at_ = stop;
    return true;
}

bool Scanner::count(std::size_t& out, const char* what, std::size_t least_bytes) {
    std::int64_t value = 0;
    if (!integer(value, what)) return false;
    if (value < 0) return fail(ErrorCode::BadValue, fmt::format("{} is {}", what, value));
    out = static_cast<std::size_t>(value);
    return check_fits(out, least_bytes, what);
}

bool Scanner::check_fits(std::size_t count, std::size_t least_bytes, const char* what) {
    if (fits(count, least_bytes)) return true;
    return fail(ErrorCode::BadSyntax,
                fmt::format("{} is {}, but only {} bytes follow: wrong, or the file is cut off", what, count, left()));
}

bool Scanner::point(Vec3& out, std::size_t index) {
    double x = 0, y = 0, z = 0;
    if (!real(x, "a coordinate") || !real(y, "a coordinate") || !real(z, "a coordinate")) return false;
    out = Vec3(x, y, z);
    return is_finite(out) || fail_not_finite(index);
}

bool Scanner::raw(std::string_view& out, std::size_t size, const char* what) {
    if (error_) return false;
    token_ = at_;
    if (size > left())
        return fail(ErrorCode::BadSyntax, fmt::format("the file is cut off: {} need {} bytes, {} follow", what, size, left()));
    out = {at_, size};
    at_ += size;
    return true;
}

bool Scanner::fail_not_finite(std::size_t vertex) {
    return fail(ErrorCode::BadValue, fmt::format("vertex {} has a coordinate that is not finite", vertex));
}

bool Scanner::fail_at(std::size_t position, ErrorCode code, std::string message) {
    if (error_) return false;
    error_ = Error{code, std::move(message), file_};
    if (binary_)
        error_->message += fmt::format(" (near byte {})", position);
    else
        error_->line = first_line_ + static_cast<std::size_t>(std::count(begin_, begin_ + position, '\n'));
    return false;
}

Error Scanner::error() const { return error_ ? *error_ : Error{ErrorCode::BadSyntax, "cannot be read", file_}; }

} // namespace trocar::engine
