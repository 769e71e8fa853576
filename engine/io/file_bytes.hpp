// A whole file in memory, gunzipped when it is gzip: what every reader starts from.
#pragma once

#include "base/result.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace trocar::engine {

/// Largest file that is read, and largest text that a .gz may unfold to. Meshes of ten million triangles fit.
inline constexpr std::size_t kMaxFileBytes = std::size_t{4} << 30; // bytes

/// A .gz may unfold to this many times its own size; meshes reach 3 to 12, a gzip bomb 1000. Small files are accepted up
/// to kFreeExpansionBytes: a regular grid of a few kilobytes may honestly compress that well.
inline constexpr std::size_t kMaxExpansion = 100;                         // [-]
inline constexpr std::size_t kFreeExpansionBytes = std::size_t{16} << 20; // bytes

/// Reads a regular file completely; gzip is recognised by its magic bytes, whatever the name says.
/// fails     FileNotFound: missing, unreadable, a folder, a pipe or a device (those could block for ever);
///           BadSyntax: damaged, truncated or bomb-like gzip, file above kMaxFileBytes
[[nodiscard]] Result<std::string> read_file_bytes(const std::filesystem::path& path);

/// Unfolds one gzip or zlib stream (or several gzip members in a row). max_bytes bounds what is allocated.
/// fails     BadSyntax, without a file name: the caller knows it
[[nodiscard]] Result<std::string> inflate_bytes(const std::string& packed, std::size_t max_bytes);

/// The file as it is, packed or not.
/// fails     FileNotFound, BadSyntax as above
[[nodiscard]] Result<std::string> read_packed_bytes(const std::filesystem::path& path);

/// The first `bytes` bytes that one gzip or zlib stream unfolds to, fewer where it ends before: for data whose size is known. Memory is
/// bounded by `bytes`, whatever the stream would unfold to.
/// fails     BadSyntax, without a file name: damaged, or cut off before it gave as many
[[nodiscard]] Result<std::string> inflate_prefix(std::string_view packed, std::size_t bytes);

/// How much a packed stream of this size may unfold to.
[[nodiscard]] constexpr std::size_t max_unfolded_bytes(std::size_t packed) noexcept {
    const std::size_t by_ratio = packed > kMaxFileBytes / kMaxExpansion ? kMaxFileBytes : packed * kMaxExpansion;
    return by_ratio > kFreeExpansionBytes ? by_ratio : kFreeExpansionBytes;
}

} // namespace trocar::engine
