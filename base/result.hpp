// Errors as values. Bad files, bad scenes and bad meshes are ordinary outcomes; broken contracts are asserts.
#pragma once

#include <cassert>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace trocar {

enum class ErrorCode {
    BadUsage,     // the command line asks for something that does not exist
    FileNotFound, // no such file, or no permission to read it
    BadSyntax,    // the file breaks its own format
    BadValue,     // the format is fine, the value is not: out of range, wrong type, unknown key
    BadMesh,      // open, inverted, non-manifold, self-intersecting where the use does not allow it
    MissingTool,  // an external program or library is not installed
    ToolFailed,   // an external program crashed, timed out or returned nothing usable
    CannotWrite,  // disk full, read-only, folder busy
    NotFinite,    // a state left its bounds: exit 3
};

/// What went wrong, where, and what was expected.
struct Error {
    ErrorCode code = ErrorCode::BadValue;
    std::string message;    // one sentence: the value that was found and what was expected
    std::string file = {};  // empty: not about a file
    std::size_t line = 0;   // 1-based; 0: unknown (binary files, whole-file errors)
    std::size_t column = 0; // 1-based; 0: unknown
    std::string key = {};   // path of the scene key, as in bodies.liver.material.density

    /// "file:line:column: key: message", without the parts that are unknown.
    [[nodiscard]] std::string to_string() const {
        std::string text = file;
        if (line > 0) text += ":" + std::to_string(line);
        if (column > 0) text += ":" + std::to_string(column);
        if (!text.empty()) text += ": ";
        if (!key.empty()) text += key + ": ";
        return text + message;
    }
};

/// Either a value or an Error. Reading the wrong one is a broken contract (assert).
template <class T>
class [[nodiscard]] Result {
public:
    Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}     // NOLINT(google-explicit-constructor)
    Result(Error error) : content_(std::in_place_index<1>, std::move(error)) {} // NOLINT(google-explicit-constructor)

    [[nodiscard]] bool ok() const noexcept { return content_.index() == 0; }
    [[nodiscard]] explicit operator bool() const noexcept { return ok(); }
    [[nodiscard]] T& value() & {
        assert(ok());
        return *std::get_if<0>(&content_);
    }
    [[nodiscard]] const T& value() const& {
        assert(ok());
        return *std::get_if<0>(&content_);
    }
    [[nodiscard]] T&& value() && {
        assert(ok());
        return std::move(*std::get_if<0>(&content_));
    }
    [[nodiscard]] const Error& error() const {
        assert(!ok());
        return *std::get_if<1>(&content_);
    }
    [[nodiscard]] T* operator->() { return &value(); }
    [[nodiscard]] const T* operator->() const { return &value(); }
    [[nodiscard]] T& operator*() & { return value(); }
    [[nodiscard]] const T& operator*() const& { return value(); }

private:
    std::variant<T, Error> content_;
};

/// Success or an Error, for what has no value to give.
template <>
class [[nodiscard]] Result<void> {
public:
    Result() = default;
    Result(Error error) : error_(std::move(error)) {} // NOLINT(google-explicit-constructor)

    [[nodiscard]] bool ok() const noexcept { return !error_.has_value(); }
    [[nodiscard]] explicit operator bool() const noexcept { return ok(); }
    [[nodiscard]] const Error& error() const {
        assert(error_);
        return *error_;
    }

private:
    std::optional<Error> error_;
};

} // namespace trocar
