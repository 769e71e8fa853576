#include "engine/io/gzip.hpp"

#include <zlib.h>

namespace trocar::engine {

namespace {

constexpr int kGzipWindow = 15 + 16; // the largest window, in gzip's wrapping
constexpr int kMemory = 9;
/// zlib counts in unsigned int.
constexpr std::size_t kPiece = std::size_t{1} << 30;

} // namespace

Result<std::string> gzip_bytes(std::string_view text) {
    z_stream stream{};
    if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
        return Error{ErrorCode::ToolFailed, "zlib cannot start"};
    std::string packed;
    char room[1 << 16];
    int outcome = Z_OK;
    while (outcome == Z_OK) {
        const std::size_t piece = text.size() < kPiece ? text.size() : kPiece;
        stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
        stream.avail_in = static_cast<uInt>(piece);
        text.remove_prefix(piece);
        do {
            stream.next_out = reinterpret_cast<Bytef*>(room);
            stream.avail_out = sizeof(room);
            outcome = deflate(&stream, text.empty() ? Z_FINISH : Z_NO_FLUSH);
            packed.append(room, sizeof(room) - stream.avail_out);
        } while (outcome == Z_OK && stream.avail_out == 0);
    }
    deflateEnd(&stream);
    if (outcome != Z_STREAM_END) return Error{ErrorCode::ToolFailed, "zlib cannot pack"};
    return packed;
}

} // namespace trocar::engine
