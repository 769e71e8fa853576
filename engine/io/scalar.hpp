// Binary numbers of mesh files: type names as PLY and VTK write them, byte order, conversion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace trocar::engine {

enum class ScalarType : std::uint8_t { Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Float32, Float64 };

/// Finds a type by any of its names: "uchar", "uint8", "unsigned_char", "UInt8", "vtktypeint64" ...
[[nodiscard]] std::optional<ScalarType> find_scalar_type(std::string_view name);

[[nodiscard]] constexpr std::size_t size_of(ScalarType type) noexcept {
    constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return kSizes[static_cast<std::size_t>(type)];
}
[[nodiscard]] constexpr bool is_real(ScalarType type) noexcept { return type >= ScalarType::Float32; }

/// A number of the file. at needs no alignment; big: most significant byte first.
[[nodiscard]] double load_real(const char* at, ScalarType type, bool big) noexcept;
/// The same for integers; unsigned 64-bit values above the signed range become -1, which no index accepts.
/// A real type gives -1.
[[nodiscard]] std::int64_t load_integer(const char* at, ScalarType type, bool big) noexcept;

} // namespace trocar::engine
