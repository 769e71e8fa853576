#include "engine/io/vtk_array.hpp"

#include "engine/io/file_bytes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace trocar::engine {
namespace {

constexpr std::int8_t kNoDigit = -1, kPadding = -2, kSpace = -3;

constexpr std::array<std::int8_t, 256> make_base64_table() {
    std::array<std::int8_t, 256> table{};
    table.fill(kNoDigit);
    const std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < digits.size(); ++i) table[static_cast<std::uint8_t>(digits[i])] = static_cast<std::int8_t>(i);
    table['='] = kPadding;
    for (const char c : {' ', '\t', '\n', '\r'}) table[static_cast<std::uint8_t>(c)] = kSpace;
    return table;
}
constexpr std::array<std::int8_t, 256> kBase64 = make_base64_table();

/// Bytes one after the other, raw or base64. Padding ends a base64 segment but not the stream: writers encode header
/// and data together or apart, and both must read the same.
class PackedBytes {
public:
    PackedBytes(std::string_view packed, bool raw) : packed_(packed), raw_(raw) {}

    bool read(std::size_t size, std::string& out) {
        out.clear();
        if (size > packed_.size() - at_ + pending_.size()) return false; // base64 only shrinks
        if (raw_) {
            out = packed_.substr(at_, size);
            at_ += size;
            return true;
        }
        while (pending_.size() < size)
            if (!decode_group()) return false;
        out = pending_.substr(0, size);
        pending_.erase(0, size);
        return true;
    }

private:
    /// Four digits to three bytes, fewer before padding.
    bool decode_group() {
        std::uint32_t bits = 0;
        int digits = 0, places = 0;
        while (places < 4) {
            if (at_ == packed_.size()) return false;
            const std::int8_t value = kBase64[static_cast<std::uint8_t>(packed_[at_])];
            if (value == kNoDigit) return false;
            ++at_;
            if (value == kSpace) continue;
            ++places;
            bits = (bits << 6) | (value >= 0 ? static_cast<std::uint32_t>(value) : 0u);
            if (value < 0) continue;
            if (++digits != places) return false; // a digit after padding
        }
        if (digits < 2) return false;
        for (int i = 0; i < digits - 1; ++i) pending_ += static_cast<char>(bits >> (16 - 8 * i));
        return true;
    }

    std::string_view packed_;
    std::size_t at_ = 0;
    std::string pending_; // decoded, not yet consumed
    bool raw_;
};

class ArrayReader {
public:
    ArrayReader(std::string_view packed, const VtkArrayFormat& format, bool raw) : in_(packed, raw), format_(format) {}

    Result<std::string> read() {
        const std::optional<std::uint64_t> first = size();
        if (!first) return cut_off();
        if (!format_.compressed) {
            std::string bytes;
            if (!in_.read(*first, bytes)) return cut_off();
            return bytes;
        }
        if (*first == 0) return std::string();
        return read_blocks(*first);
    }

private:
    static Error cut_off() { return {ErrorCode::BadSyntax, "the binary array is cut off or no base64"}; }

    std::optional<std::uint64_t> size() {
        std::string bytes;
        if (!in_.read(format_.long_header ? 8 : 4, bytes)) return std::nullopt;
        const std::int64_t value = load_integer(bytes.data(), format_.long_header ? ScalarType::UInt64 : ScalarType::UInt32, format_.big);
        if (value < 0) return std::nullopt;
        return static_cast<std::uint64_t>(value);
    }

    /// Header: number of blocks, their size unpacked, size of the last one (0: like the others), sizes packed.
    Result<std::string> read_blocks(std::uint64_t blocks) {
        const auto block_bytes = size(), last_bytes = size();
        if (!block_bytes || !last_bytes) return cut_off();
        std::vector<std::uint64_t> packed_sizes;
        for (std::uint64_t i = 0; i < blocks; ++i) {
            const auto packed = size(); // ends with the bytes, whatever the header claims
            if (!packed) return cut_off();
            packed_sizes.push_back(*packed);
        }
        const std::size_t limit = max_unfolded_bytes(format_.file_bytes);
        std::string all, packed;
        for (const std::uint64_t packed_size : packed_sizes) {
            if (!in_.read(packed_size, packed)) return cut_off();
            const Result<std::string> block = inflate_bytes(packed, std::min<std::size_t>(*block_bytes, limit - all.size()));
            if (!block) return block.error();
            all += *block;
        }
        const std::uint64_t expected = (blocks - 1) * *block_bytes + (*last_bytes == 0 ? *block_bytes : *last_bytes);
        if (all.size() != expected)
            return Error{ErrorCode::BadSyntax, fmt::format("the blocks hold {} bytes, their header says {}", all.size(), expected)};
        return all;
    }

    PackedBytes in_;
    const VtkArrayFormat& format_;
};

} // namespace

Result<std::string> unpack_vtk_array(std::string_view packed, const VtkArrayFormat& format, bool raw) {
    return ArrayReader(packed, format, raw).read();
}

} // namespace trocar::engine
