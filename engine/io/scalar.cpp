#include "engine/io/scalar.hpp"

#include <bit>
#include <cstring>
#include <limits>
#include <utility>

namespace trocar::engine {
namespace {

constexpr std::pair<std::string_view, ScalarType> kNames[] = {
    {"char", ScalarType::Int8},
    {"int8", ScalarType::Int8},
    {"Int8", ScalarType::Int8},
    {"uchar", ScalarType::UInt8},
    {"uint8", ScalarType::UInt8},
    {"UInt8", ScalarType::UInt8},
    {"unsigned_char", ScalarType::UInt8},
    {"short", ScalarType::Int16},
    {"int16", ScalarType::Int16},
    {"Int16", ScalarType::Int16},
    {"ushort", ScalarType::UInt16},
    {"uint16", ScalarType::UInt16},
    {"UInt16", ScalarType::UInt16},
    {"unsigned_short", ScalarType::UInt16},
    {"int", ScalarType::Int32},
    {"int32", ScalarType::Int32},
    {"Int32", ScalarType::Int32},
    {"uint", ScalarType::UInt32},
    {"uint32", ScalarType::UInt32},
    {"UInt32", ScalarType::UInt32},
    {"unsigned_int", ScalarType::UInt32},
    {"int64", ScalarType::Int64},
    {"Int64", ScalarType::Int64},
    {"long", ScalarType::Int64},
    {"vtktypeint64", ScalarType::Int64},
    {"vtkIdType", ScalarType::Int64},
    {"uint64", ScalarType::UInt64},
    {"UInt64", ScalarType::UInt64},
    {"unsigned_long", ScalarType::UInt64},
    {"float", ScalarType::Float32},
    {"float32", ScalarType::Float32},
    {"Float32", ScalarType::Float32},
    {"double", ScalarType::Float64},
    {"float64", ScalarType::Float64},
    {"Float64", ScalarType::Float64},
    {"vtktypeint32", ScalarType::Int32},
};

template <class Bits>
Bits load_bits(const char* at, bool big) noexcept {
    Bits bits = 0;
    std::memcpy(&bits, at, sizeof bits);
    if (big == (std::endian::native == std::endian::big)) return bits;
    if constexpr (sizeof(Bits) == 2) return __builtin_bswap16(bits);
    if constexpr (sizeof(Bits) == 4) return __builtin_bswap32(bits);
    if constexpr (sizeof(Bits) == 8) return __builtin_bswap64(bits);
    return bits;
}

} // namespace

std::optional<ScalarType> find_scalar_type(std::string_view name) {
    for (const auto& [known, type] : kNames)
        if (known == name) return type;
    return std::nullopt;
}

double load_real(const char* at, ScalarType type, bool big) noexcept {
    switch (type) {
    case ScalarType::Float32:
        return static_cast<double>(std::bit_cast<float>(load_bits<std::uint32_t>(at, big)));
    case ScalarType::Float64:
        return std::bit_cast<double>(load_bits<std::uint64_t>(at, big));
    case ScalarType::UInt64:
        return static_cast<double>(load_bits<std::uint64_t>(at, big));
    default:
        return static_cast<double>(load_integer(at, type, big));
    }
}

std::int64_t load_integer(const char* at, ScalarType type, bool big) noexcept {
    switch (type) {
    case ScalarType::Int8:
        return static_cast<std::int8_t>(*at);
    case ScalarType::UInt8:
        return static_cast<std::uint8_t>(*at);
    case ScalarType::Int16:
        return static_cast<std::int16_t>(load_bits<std::uint16_t>(at, big));
    case ScalarType::UInt16:
        return load_bits<std::uint16_t>(at, big);
    case ScalarType::Int32:
        return static_cast<std::int32_t>(load_bits<std::uint32_t>(at, big));
    case ScalarType::UInt32:
        return load_bits<std::uint32_t>(at, big);
    case ScalarType::Int64:
        return static_cast<std::int64_t>(load_bits<std::uint64_t>(at, big));
    case ScalarType::UInt64: {
        const std::uint64_t value = load_bits<std::uint64_t>(at, big);
        return value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) ? -1 : static_cast<std::int64_t>(value);
    }
    default:
        return -1;
    }
}

} // namespace trocar::engine
