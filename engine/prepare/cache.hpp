// A cache of prepared meshes by content: the key is a hash of every byte that went in and of the maker's version. An entry
// that is missing, truncated or of another key is simply absent; a cache that cannot be written is no error.
#pragma once

#include "base/mesh.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace trocar::engine {

/// 128-bit FNV-1a over what was fed in. Tells accidents apart, not adversaries.
class ContentHash {
public:
    void feed(const void* bytes, std::size_t size) noexcept;
    void feed(std::string_view text) noexcept; // length included: "ab" + "c" differs from "a" + "bc"
    void feed(double value) noexcept;
    void feed(std::uint64_t value) noexcept;
    void feed(const TriMesh& mesh) noexcept;
    void feed(const TetMesh& mesh) noexcept;
    [[nodiscard]] std::string hex() const; // 32 digits

private:
    unsigned __int128 state_ = (static_cast<unsigned __int128>(0x6c62272e07bb0142ULL) << 64) | 0x62b821756295c58dULL;
};

/// Hash of the sources that make what is cached (base, assets, fem, spheretree, engine/io, engine/prepare): part of every key, so that an
/// entry made by other code is simply absent. 64 digits; generated at build time by cmake/hash_sources.cmake.
[[nodiscard]] std::string_view maker_version() noexcept;

/// $TROCAR_CACHE, else $XDG_CACHE_HOME/trocar, else ~/.cache/trocar; empty when none is known
/// or $TROCAR_CACHE is "off".
[[nodiscard]] std::filesystem::path find_cache_folder();

/// Payload stored under the key (a hex hash), or nothing.
[[nodiscard]] std::optional<std::string> read_cache(std::string_view kind, const std::string& key);
/// Atomic: a reader sees the whole entry or none. False when it could not be kept.
bool write_cache(std::string_view kind, const std::string& key, std::string_view payload);

/// Bit-exact mesh payloads (native byte order; the entry's header refuses another).
[[nodiscard]] std::string pack_mesh(const TetMesh& mesh);
[[nodiscard]] std::string pack_mesh(const TriMesh& mesh);
[[nodiscard]] std::optional<TetMesh> unpack_tets(std::string_view payload);
[[nodiscard]] std::optional<TriMesh> unpack_triangles(std::string_view payload);

} // namespace trocar::engine
