// 64-bit FNV-1a over the bits of numbers, in a fixed byte order: the same on every machine.
#pragma once

#include "base/vec.hpp"

#include <bit>
#include <cstdint>
#include <string_view>
#include <vector>

namespace trocar::engine {

class BitHash {
public:
    void add(std::uint64_t value) noexcept {
        for (int byte = 0; byte < 8; ++byte) add_byte(static_cast<unsigned char>((value >> (8 * byte)) & 0xff));
    }
    void add(double value) noexcept { add(std::bit_cast<std::uint64_t>(value)); }
    void add(const Vec3& v) noexcept {
        for (int axis = 0; axis < 3; ++axis) add(v[axis]);
    }
    void add(const std::vector<Vec3>& values) noexcept {
        for (const Vec3& v : values) add(v);
    }
    /// With its length, so that "ab", "c" is not "a", "bc".
    void add_text(std::string_view text) noexcept {
        add(static_cast<std::uint64_t>(text.size()));
        add_bytes(text);
    }
    void add_bytes(std::string_view bytes) noexcept {
        for (const char c : bytes) add_byte(static_cast<unsigned char>(c));
    }
    [[nodiscard]] std::uint64_t value() const noexcept { return hash_; }

private:
    void add_byte(unsigned char byte) noexcept {
        hash_ ^= byte;
        hash_ *= 0x100000001b3ULL;
    }
    std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

} // namespace trocar::engine
