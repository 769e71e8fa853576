// The engine's errors as Python exceptions.
#pragma once

#include "base/result.hpp"

#include <exception>
#include <string>

namespace trocar::python {

/// Becomes trocar.Error, with everything that an Error says.
class EngineError final : public std::exception {
public:
    explicit EngineError(Error error) : error_(std::move(error)), text_(error_.to_string()) {}
    [[nodiscard]] const char* what() const noexcept override { return text_.c_str(); }
    [[nodiscard]] const Error& error() const noexcept { return error_; }

private:
    Error error_;
    std::string text_;
};

/// Becomes trocar.StoppedError: a simulator whose state left its bounds is asked for more.
class StoppedError final : public std::exception {
public:
    explicit StoppedError(std::string text) : text_(std::move(text)) {}
    [[nodiscard]] const char* what() const noexcept override { return text_.c_str(); }

private:
    std::string text_;
};

template <class T>
T value_of(Result<T> result) {
    if (!result.ok()) throw EngineError(result.error());
    return std::move(*result);
}
inline void check(const Result<void>& result) {
    if (!result.ok()) throw EngineError(result.error());
}

[[noreturn]] inline void bad_usage(std::string message, std::string key = {}) {
    throw EngineError({ErrorCode::BadUsage, std::move(message), {}, 0, 0, std::move(key)});
}

} // namespace trocar::python
