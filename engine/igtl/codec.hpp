// OpenIGTLink messages as bytes, packed and unpacked by the library of that name. On the wire lengths are mm, here m; the frame is RAS on
// both sides: +x the patient's right, +y the front, +z the head, which is the scene's own (docs/units.md) and 3D Slicer's.
//
// This work is based on:
//   Tokuda et al. 2009, "OpenIGTLink: an open network protocol for image-guided therapy environment".
// What a stranger sends is measured before the library sees it: its own readers trust the sizes that a message names.
#pragma once

#include "base/mesh.hpp"
#include "base/vec.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine::igtl {

/// The program was built with the library. Without it nothing else of this file does anything.
[[nodiscard]] bool has_library() noexcept;

inline constexpr std::size_t kHeaderSize = 58;  // bytes
inline constexpr std::size_t kLongestName = 20; // bytes of a device's name
/// Versions of a message's header that this reads: 2 puts a second header before the content, and metadata after it.
inline constexpr std::uint16_t kNewestHeader = 2;

struct Header {
    std::uint16_t version = 0;
    std::string type, name; // without the zeros behind them
    std::uint64_t body_size = 0, crc = 0;
};

/// bytes  [kHeaderSize]
[[nodiscard]] Header read_header(std::string_view bytes);
[[nodiscard]] bool has_its_checksum(const Header& header, std::string_view body);
/// The body without second header and metadata; nothing: they do not fit into it.
[[nodiscard]] std::optional<std::string_view> content_of(const Header& header, std::string_view body);

/// Axes are columns of the matrix: unit vectors of what is at the origin.
struct Transform {
    Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
    Vec3 origin = Vec3::Zero(); // m
    [[nodiscard]] bool finite() const noexcept { return x.allFinite() && y.allFinite() && z.allFinite() && origin.allFinite(); }
};

/// Of a TRANSFORM or STRING. Nothing: the content has not the size that it must have.
[[nodiscard]] std::optional<Transform> read_transform(const Header& header, std::string_view content);
[[nodiscard]] std::optional<std::string> read_string(const Header& header, std::string_view content);

using Point = std::array<float, 3>; // m

/// Codes of a STATUS, as the protocol numbers them.
enum class Status { Ok = 1, Failed = 2, NotFound = 4, AccessDenied = 5, Busy = 6, BadChecksum = 9, UnknownInstruction = 12, UnknownVersion = 17 };

/// time_s  simulated; the message's time stamp
[[nodiscard]] std::string pack_transform(const std::string& name, double time_s, const Transform& transform);
[[nodiscard]] std::string pack_string(const std::string& name, double time_s, const std::string& text);
[[nodiscard]] std::string pack_status(const std::string& name, double time_s, Status code, const std::string& text);
[[nodiscard]] std::string pack_capability(const std::string& name, const std::vector<std::string>& types);
[[nodiscard]] std::string pack_surface(const std::string& name, double time_s, std::span<const Point> points, std::span<const Triangle> triangles);
/// The same surface at another moment, by a copy of its message.
[[nodiscard]] std::string move_surface(const std::string& packed, double time_s, std::span<const Point> points);

} // namespace trocar::engine::igtl
