// Numbers as the network writes them, the highest byte first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace trocar::engine::igtl {

/// T  unsigned
template <class T>
[[nodiscard]] T get_number(std::string_view bytes, std::size_t at) noexcept {
    T value = 0;
    for (std::size_t k = 0; k < sizeof(T); ++k) value = static_cast<T>(value << 8 | static_cast<unsigned char>(bytes[at + k]));
    return value;
}

template <class T>
void put_number(std::string& bytes, std::size_t at, T value) noexcept {
    for (std::size_t k = sizeof(T); k-- > 0; value = static_cast<T>(value >> 8)) bytes[at + k] = static_cast<char>(value & 0xff);
}

} // namespace trocar::engine::igtl
