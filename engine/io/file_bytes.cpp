#include "engine/io/file_bytes.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <memory>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

constexpr int kGzipOrZlib = 15 + 32; // zlib's windowBits: largest window, header recognised by itself

struct Descriptor {
    int fd = -1;
    explicit Descriptor(int handle) : fd(handle) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() {
        if (fd >= 0) ::close(fd);
    }
};

/// Why the thing at path is no readable file, or 0 with its size.
Result<std::size_t> check_regular(int fd, const std::string& name) {
    struct stat info {};
    if (::fstat(fd, &info) != 0) return Error{ErrorCode::FileNotFound, fmt::format("cannot be examined: {}", std::strerror(errno)), name};
    if (S_ISDIR(info.st_mode)) return Error{ErrorCode::FileNotFound, "is a folder, not a file", name};
    if (!S_ISREG(info.st_mode)) return Error{ErrorCode::FileNotFound, "is a pipe or a device, not a file", name};
    const auto size = static_cast<std::size_t>(info.st_size);
    if (size > kMaxFileBytes)
        return Error{ErrorCode::BadSyntax, fmt::format("has {} bytes; at most {} are read", size, kMaxFileBytes), name};
    return size;
}

Result<std::string> read_raw(const std::filesystem::path& path) {
    const std::string name = path.string();
    // O_NONBLOCK: opening a pipe without a writer must not block.
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.fd < 0) return Error{ErrorCode::FileNotFound, fmt::format("cannot be opened: {}", std::strerror(errno)), name};
    const Result<std::size_t> size = check_regular(file.fd, name);
    if (!size) return size.error();
    std::string bytes(*size, '\0');
    std::size_t filled = 0;
    while (filled < bytes.size()) {
        const ssize_t got = ::read(file.fd, bytes.data() + filled, bytes.size() - filled);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return Error{ErrorCode::FileNotFound, fmt::format("cannot be read: {}", std::strerror(errno)), name};
        if (got == 0) break; // it shrank while we read
        filled += static_cast<std::size_t>(got);
    }
    bytes.resize(filled);
    return bytes;
}

struct StreamEnd {
    void operator()(z_stream* stream) const { ::inflateEnd(stream); }
};

uInt chunk(std::size_t bytes) { return static_cast<uInt>(std::min<std::size_t>(bytes, std::numeric_limits<int>::max())); }

} // namespace

namespace {

enum class Beyond : std::uint8_t { IsAnError, IsLeftOut };

/// Bytes that deflate makes of one, at most.
constexpr std::size_t kMostUnfolded = 1032;

Result<std::string> inflate_up_to(std::string_view packed, std::size_t max_bytes, Beyond beyond) {
    z_stream stream{};
    if (::inflateInit2(&stream, kGzipOrZlib) != Z_OK) return Error{ErrorCode::BadSyntax, "zlib could not start"};
    const std::unique_ptr<z_stream, StreamEnd> ender(&stream);
    std::string text;
    if (beyond == Beyond::IsLeftOut) text.reserve(std::min(max_bytes, packed.size() * kMostUnfolded + 4096)); // it is not copied as it grows
    text.resize(std::min(max_bytes, packed.size() * 4 + 4096));
    std::size_t read = 0, written = 0;
    for (;;) {
        stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + read));
        stream.avail_in = chunk(packed.size() - read);
        stream.next_out = reinterpret_cast<Bytef*>(text.data() + written);
        stream.avail_out = chunk(text.size() - written);
        const uInt in_before = stream.avail_in, out_before = stream.avail_out;
        const int status = ::inflate(&stream, Z_NO_FLUSH);
        read += in_before - stream.avail_in;
        written += out_before - stream.avail_out;
        if (status == Z_STREAM_END) {
            // Another member may follow; anything else after the end is padding that gzip, too, passes over.
            if (packed.size() - read < 2 || packed[read] != '\x1f' || packed[read + 1] != '\x8b') break;
            if (::inflateReset(&stream) != Z_OK) break;
            continue;
        }
        if (status != Z_OK && status != Z_BUF_ERROR)
            return Error{ErrorCode::BadSyntax, fmt::format("damaged compressed data near byte {}", read)};
        if (written == text.size()) {
            if (written >= max_bytes && beyond == Beyond::IsLeftOut) break;
            if (written >= max_bytes)
                return Error{ErrorCode::BadSyntax, fmt::format("unfolds to more than {} bytes, {} times its size: not a mesh", max_bytes,
                                                               max_bytes / std::max<std::size_t>(packed.size(), 1))};
            text.resize(std::min(max_bytes, text.size() * 2));
        } else if (read == packed.size()) {
            return Error{ErrorCode::BadSyntax, "the compressed data is cut off"};
        }
    }
    text.resize(written);
    return text;
}

} // namespace

Result<std::string> inflate_bytes(const std::string& packed, std::size_t max_bytes) {
    return inflate_up_to(packed, max_bytes, Beyond::IsAnError);
}

Result<std::string> inflate_prefix(std::string_view packed, std::size_t bytes) {
    if (bytes == 0) return std::string();
    return inflate_up_to(packed, bytes, Beyond::IsLeftOut);
}

Result<std::string> read_packed_bytes(const std::filesystem::path& path) { return read_raw(path); }

Result<std::string> read_file_bytes(const std::filesystem::path& path) {
    Result<std::string> bytes = read_raw(path);
    if (!bytes || bytes->size() < 2 || (*bytes)[0] != '\x1f' || (*bytes)[1] != '\x8b') return bytes;
    Result<std::string> text = inflate_bytes(*bytes, max_unfolded_bytes(bytes->size()));
    if (text) return text;
    Error error = text.error();
    error.file = path.string();
    return error;
}

} // namespace trocar::engine
