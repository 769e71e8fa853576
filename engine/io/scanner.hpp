// Walks over the bytes of a mesh file: words, numbers, raw binary. The first failure is kept with its line, so that
// readers can chain calls with && and ask for the error once at the end.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace trocar::engine {

class Scanner {
public:
    /// first_line  line number of the first byte, for a text that was cut out of a larger file
    Scanner(std::string_view bytes, std::string file, std::size_t first_line = 1)
        : begin_(bytes.data()), at_(begin_), end_(begin_ + bytes.size()), token_(begin_), first_line_(first_line), file_(std::move(file)) {}

    /// From this character to the end of its line is a comment. 0: none.
    void set_comment(char mark) noexcept { comment_ = mark; }
    /// A backslash at the end of a line joins the next one to it (OBJ).
    void set_continuation(bool on) noexcept { continuation_ = on; }
    /// Errors give a byte offset, for lines mean nothing.
    void set_binary(bool on) noexcept { binary_ = on; }

    /// Passes over white space and comments; true at the end of the bytes.
    [[nodiscard]] bool at_end() {
        skip_space(true);
        return at_ == end_;
    }
    /// Passes over blanks within the line; true where nothing more stands in it.
    [[nodiscard]] bool at_line_end() {
        skip_space(false);
        return at_ == end_ || *at_ == '\n';
    }
    /// Goes to the beginning of the next line.
    void skip_line() noexcept;
    /// The rest of this line, without the blanks around it; goes to the next line.
    [[nodiscard]] std::string_view rest_of_line();

    /// Reads the next word. what names it in messages.
    [[nodiscard]] bool word(std::string_view& out, const char* what);
    /// The next word without reading it; empty at the end.
    [[nodiscard]] std::string_view peek_word();
    /// Any real number, NaN and infinity included.
    [[nodiscard]] bool real(double& out, const char* what);
    [[nodiscard]] bool integer(std::int64_t& out, const char* what);
    /// A number of things of at least least_bytes each, which must still fit into the bytes that follow.
    [[nodiscard]] bool count(std::size_t& out, const char* what, std::size_t least_bytes);
    /// Three finite numbers. index is for the message: "vertex 17".
    [[nodiscard]] bool point(Vec3& out, std::size_t index);
    /// size bytes as they are.
    [[nodiscard]] bool raw(std::string_view& out, std::size_t size, const char* what);

    [[nodiscard]] bool fits(std::size_t count, std::size_t least_bytes) const noexcept {
        return least_bytes == 0 || count <= left() / least_bytes;
    }
    /// Fails where count things of least_bytes cannot follow any more.
    [[nodiscard]] bool check_fits(std::size_t count, std::size_t least_bytes, const char* what);
    [[nodiscard]] std::size_t left() const noexcept { return static_cast<std::size_t>(end_ - at_); }
    [[nodiscard]] std::size_t position() const noexcept { return static_cast<std::size_t>(at_ - begin_); }
    /// Where the last word began.
    [[nodiscard]] std::size_t token_position() const noexcept { return static_cast<std::size_t>(token_ - begin_); }

    /// Keeps the first failure, at the last word read. Always false.
    bool fail(ErrorCode code, std::string message) { return fail_at(token_position(), code, std::move(message)); }
    bool fail_at(std::size_t position, ErrorCode code, std::string message);
    bool fail_not_finite(std::size_t vertex);
    [[nodiscard]] bool failed() const noexcept { return error_.has_value(); }
    [[nodiscard]] Error error() const;

private:
    void skip_space(bool across_lines) noexcept;
    [[nodiscard]] static bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
    [[nodiscard]] const char* token_end() const noexcept {
        const char* p = at_;
        while (p != end_ && !is_blank(*p) && *p != '\n' && *p != comment_or_newline()) ++p;
        return p;
    }
    [[nodiscard]] char comment_or_newline() const noexcept { return comment_ != 0 ? comment_ : '\n'; }
    bool start_token(const char* what);
    bool fail_number(const char* stop, const char* what, const char* kind);

    const char *begin_, *at_, *end_, *token_;
    std::size_t first_line_;
    std::string file_;
    char comment_ = 0;
    bool continuation_ = false, binary_ = false;
    std::optional<Error> error_;
};

} // namespace trocar::engine
