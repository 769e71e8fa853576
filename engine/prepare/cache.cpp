#include "engine/prepare/cache.hpp"

#include "engine/io/atomic_file.hpp"

#include <bit>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace trocar::engine {

namespace {

/// Raised when the layout of entries changes. The tail is written in native byte order: another machine's file differs.
constexpr std::uint64_t kEntryMark = 0x31454c4443414353ULL + (std::uint64_t{1} << 56);

struct EntryHeader {
    std::uint64_t mark;
    std::uint64_t payload_size;
    char key[32];
    char payload_hash[32];
};

std::string hash_of(std::string_view payload) {
    ContentHash hash;
    hash.feed(payload);
    return hash.hex();
}

std::filesystem::path entry_path(const std::filesystem::path& folder, std::string_view kind, const std::string& key) {
    return folder / (std::string(kind) + "-" + key + ".bin");
}

/// Fixed-size rows as raw bytes behind their count.
template <class Row>
void pack_rows(std::string& out, const std::vector<Row>& rows) {
    const std::uint64_t count = rows.size();
    out.append(reinterpret_cast<const char*>(&count), sizeof count);
    out.append(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(Row));
}

template <class Row>
bool unpack_rows(std::string_view& in, std::vector<Row>& rows) {
    std::uint64_t count = 0;
    if (in.size() < sizeof count) return false;
    std::memcpy(&count, in.data(), sizeof count);
    in.remove_prefix(sizeof count);
    if (count > in.size() / sizeof(Row)) return false;
    rows.resize(count);
    if (count > 0) std::memcpy(static_cast<void*>(rows.data()), in.data(), count * sizeof(Row));
    in.remove_prefix(count * sizeof(Row));
    return true;
}

static_assert(sizeof(Vec3) == 24 && sizeof(Tet) == 16 && sizeof(Triangle) == 12, "rows are stored as they lie in memory");

template <class Cell>
bool indices_fit(const std::vector<Cell>& cells, std::size_t vertex_count) {
    for (const Cell& cell : cells)
        for (const Index v : cell)
            if (v >= vertex_count) return false;
    return true;
}

} // namespace

void ContentHash::feed(const void* bytes, std::size_t size) noexcept {
    constexpr unsigned __int128 kPrime = (static_cast<unsigned __int128>(0x0000000001000000ULL) << 64) | 0x000000000000013bULL;
    const auto* at = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < size; ++i) state_ = (state_ ^ at[i]) * kPrime;
}

void ContentHash::feed(std::string_view text) noexcept {
    feed(static_cast<std::uint64_t>(text.size()));
    feed(text.data(), text.size());
}

void ContentHash::feed(double value) noexcept { feed(std::bit_cast<std::uint64_t>(value)); }
void ContentHash::feed(std::uint64_t value) noexcept { feed(&value, sizeof value); }

void ContentHash::feed(const TriMesh& mesh) noexcept {
    feed(static_cast<std::uint64_t>(mesh.vertices.size()));
    feed(mesh.vertices.data(), mesh.vertices.size() * sizeof(Vec3));
    feed(static_cast<std::uint64_t>(mesh.triangles.size()));
    feed(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
}

void ContentHash::feed(const TetMesh& mesh) noexcept {
    feed(static_cast<std::uint64_t>(mesh.vertices.size()));
    feed(mesh.vertices.data(), mesh.vertices.size() * sizeof(Vec3));
    feed(static_cast<std::uint64_t>(mesh.tets.size()));
    feed(mesh.tets.data(), mesh.tets.size() * sizeof(Tet));
}

std::string ContentHash::hex() const {
    constexpr const char* kDigits = "0123456789abcdef";
    std::string text(32, '0');
    for (int i = 0; i < 32; ++i) text[static_cast<std::size_t>(i)] = kDigits[static_cast<int>((state_ >> (4 * (31 - i))) & 15)];
    return text;
}

std::filesystem::path find_cache_folder() {
    if (const char* own = std::getenv("TROCAR_CACHE"); own && *own) {
        if (std::string_view(own) == "off") return {};
        return own;
    }
    if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg && *xdg) return std::filesystem::path(xdg) / "trocar";
    if (const char* home = std::getenv("HOME"); home && *home) return std::filesystem::path(home) / ".cache" / "trocar";
    return {};
}

std::optional<std::string> read_cache(std::string_view kind, const std::string& key) {
    const std::filesystem::path folder = find_cache_folder();
    if (folder.empty() || key.size() != sizeof(EntryHeader::key)) return std::nullopt;
    std::ifstream in(entry_path(folder, kind, key), std::ios::binary | std::ios::ate);
    if (!in) return std::nullopt;
    const std::streamoff size = in.tellg();
    EntryHeader header{};
    if (size < static_cast<std::streamoff>(sizeof header)) return std::nullopt;
    in.seekg(0);
    in.read(reinterpret_cast<char*>(&header), sizeof header);
    if (header.mark != kEntryMark || header.payload_size != static_cast<std::uint64_t>(size) - sizeof header) return std::nullopt;
    std::string payload(header.payload_size, '\0');
    in.read(payload.data(), static_cast<std::streamsize>(payload.size()));
    if (!in || std::string_view(header.key, 32) != key || std::string_view(header.payload_hash, 32) != hash_of(payload))
        return std::nullopt;
    return payload;
}

bool write_cache(std::string_view kind, const std::string& key, std::string_view payload) {
    const std::filesystem::path folder = find_cache_folder();
    if (folder.empty() || key.size() != sizeof(EntryHeader::key)) return false;
    std::error_code failure;
    std::filesystem::create_directories(folder, failure);
    if (failure) return false;
    EntryHeader header{.mark = kEntryMark, .payload_size = payload.size(), .key = {}, .payload_hash = {}};
    std::memcpy(header.key, key.data(), sizeof header.key);
    std::memcpy(header.payload_hash, hash_of(payload).data(), sizeof header.payload_hash);
    std::string entry(reinterpret_cast<const char*>(&header), sizeof header);
    entry += payload;
    return write_file_atomically(entry_path(folder, kind, key), entry).ok();
}

std::string pack_mesh(const TetMesh& mesh) {
    std::string out;
    pack_rows(out, mesh.vertices);
    pack_rows(out, mesh.tets);
    return out;
}

std::string pack_mesh(const TriMesh& mesh) {
    std::string out;
    pack_rows(out, mesh.vertices);
    pack_rows(out, mesh.triangles);
    return out;
}

std::optional<TetMesh> unpack_tets(std::string_view payload) {
    TetMesh mesh;
    if (!unpack_rows(payload, mesh.vertices) || !unpack_rows(payload, mesh.tets) || !payload.empty()) return std::nullopt;
    if (!indices_fit(mesh.tets, mesh.vertices.size())) return std::nullopt;
    return mesh;
}

std::optional<TriMesh> unpack_triangles(std::string_view payload) {
    TriMesh mesh;
    if (!unpack_rows(payload, mesh.vertices) || !unpack_rows(payload, mesh.triangles) || !payload.empty()) return std::nullopt;
    if (!indices_fit(mesh.triangles, mesh.vertices.size())) return std::nullopt;
    return mesh;
}

} // namespace trocar::engine
