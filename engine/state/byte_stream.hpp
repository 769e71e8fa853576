// Numbers to bytes and back, in one fixed order: a writer and a reader with the same calls, so that one description of a structure
// serves both.
#pragma once

#include "base/contact.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace trocar::engine {

/// As many bytes as the number has, lowest first.
class ByteWriter {
public:
    explicit ByteWriter(std::string& bytes) noexcept : bytes_(&bytes) {}

    template <class Number>
    void number(const Number& value) {
        if constexpr (std::is_same_v<Number, double>)
            put<8>(std::bit_cast<std::uint64_t>(value));
        else if constexpr (std::is_same_v<Number, bool>)
            put<1>(value ? 1 : 0);
        else if constexpr (std::is_same_v<Number, Thing>)
            put<sizeof(value.code())>(value.code());
        else
            put<sizeof(Number)>(static_cast<std::uint64_t>(value));
    }
    void vector(const Vec3& v) {
        for (int axis = 0; axis < 3; ++axis) number(v[axis]);
    }
    template <class T, class Each>
    void list(const std::vector<T>& values, Each&& each) {
        number(static_cast<std::uint64_t>(values.size()));
        for (const T& value : values) each(value);
    }
    template <class T, class Each>
    void optional(const std::optional<T>& value, Each&& each) {
        number(value.has_value());
        if (value) each(*value);
    }
    void text(const std::string& value) {
        list(std::vector<char>(value.begin(), value.end()), [this](char c) { put<1>(static_cast<unsigned char>(c)); });
    }

private:
    template <std::size_t Bytes>
    void put(std::uint64_t value) {
        for (std::size_t k = 0; k < Bytes; ++k) bytes_->push_back(static_cast<char>((value >> (8 * k)) & 0xff));
    }
    std::string* bytes_;
};

/// The same calls fill what they are given. Behind the end everything is zero and ok() is false; lists end there, whatever their
/// count says, so that a wrong one costs no memory.
class ByteReader {
public:
    explicit ByteReader(std::string_view bytes) noexcept : left_(bytes) {}

    [[nodiscard]] bool ok() const noexcept { return ok_; }
    [[nodiscard]] bool at_end() const noexcept { return left_.empty(); }
    [[nodiscard]] std::size_t left() const noexcept { return left_.size(); }

    template <class Number>
    void number(Number& value) {
        if constexpr (std::is_same_v<Number, double>)
            value = std::bit_cast<double>(get<8>());
        else if constexpr (std::is_same_v<Number, bool>)
            value = get<1>() == 1;
        else if constexpr (std::is_same_v<Number, Thing>)
            value = Thing::from_code(static_cast<std::uint16_t>(get<sizeof(value.code())>()));
        else
            value = static_cast<Number>(get<sizeof(Number)>());
    }
    void vector(Vec3& v) {
        for (int axis = 0; axis < 3; ++axis) number(v[axis]);
    }
    template <class T, class Each>
    void list(std::vector<T>& values, Each&& each) {
        std::uint64_t count = 0;
        number(count);
        values.clear(); // keeps its memory: lists of the step do not grow later
        for (std::uint64_t k = 0; k < count && ok_; ++k) each(values.emplace_back());
        if (!ok_ && !values.empty()) values.pop_back();
    }
    template <class T, class Each>
    void optional(std::optional<T>& value, Each&& each) {
        bool there = false;
        number(there);
        if (there)
            each(value.emplace());
        else
            value.reset();
    }
    void text(std::string& value) {
        std::vector<char> letters;
        list(letters, [this](char& c) { c = static_cast<char>(get<1>()); });
        value.assign(letters.begin(), letters.end());
    }

private:
    template <std::size_t Bytes>
    std::uint64_t get() noexcept {
        std::uint64_t value = 0;
        ok_ = ok_ && left_.size() >= Bytes;
        if (!ok_) return 0;
        for (std::size_t k = 0; k < Bytes; ++k) value |= static_cast<std::uint64_t>(static_cast<unsigned char>(left_[k])) << (8 * k);
        left_.remove_prefix(Bytes);
        return value;
    }
    std::string_view left_;
    bool ok_ = true;
};

} // namespace trocar::engine
