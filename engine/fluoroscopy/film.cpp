#include "engine/fluoroscopy/film.hpp"

#include "engine/fluoroscopy/grey_png.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr std::size_t kSignature = 8, kHead = kSignature + 25; // bytes: with the IHDR chunk

void put_big(std::string& out, std::uint32_t value, int bytes) {
    for (int k = bytes - 1; k >= 0; --k) out.push_back(static_cast<char>(value >> (8 * k)));
}

std::uint32_t read_big(std::string_view bytes, std::size_t at) noexcept {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
    return value;
}

void put_chunk(std::string& out, std::string_view type, std::string_view content) {
    put_big(out, static_cast<std::uint32_t>(content.size()), 4);
    const std::size_t begin = out.size();
    out += type;
    out += content;
    put_big(out, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(out.data() + begin), static_cast<uInt>(out.size() - begin))), 4);
}

/// The compressed rows of a PNG file that encode_grey_png made.
std::string image_data(std::string_view png) {
    std::string data;
    for (std::size_t at = kSignature; at + 12 <= png.size();) {
        const std::uint32_t length = read_big(png, at);
        if (png.substr(at + 4, 4) == "IDAT") data += png.substr(at + 8, length);
        at += 12 + length;
    }
    return data;
}

} // namespace

Result<std::string> encode_film(std::span<const GreyFrame> frames, double seconds) {
    if (frames.empty()) return Error{ErrorCode::BadValue, "a film has one frame at least"};
    const auto milliseconds = static_cast<std::uint32_t>(std::clamp(std::lround(1e3 * seconds), 10L, 60000L));
    std::string film;
    std::uint32_t sequence = 0;
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const GreyFrame& frame = frames[k];
        if (frame.width != frames[0].width || frame.height != frames[0].height || frame.bits != frames[0].bits)
            return Error{ErrorCode::BadValue, fmt::format("frame {} of a film has another size than the first", k)};
        const Result<std::string> png = encode_grey_png(frame);
        if (!png) return png.error();
        if (k == 0) {
            film = png->substr(0, kHead);
            std::string control;
            put_big(control, static_cast<std::uint32_t>(frames.size()), 4), put_big(control, 0, 4); // without end
            put_chunk(film, "acTL", control);
        }
        std::string control;
        put_big(control, sequence++, 4), put_big(control, frame.width, 4), put_big(control, frame.height, 4), put_big(control, 0, 4), put_big(control, 0, 4);
        put_big(control, milliseconds, 2), put_big(control, 1000, 2), put_big(control, 0, 2);
        put_chunk(film, "fcTL", control);
        std::string data;
        if (k > 0) put_big(data, sequence++, 4);
        data += image_data(*png);
        put_chunk(film, k == 0 ? "IDAT" : "fdAT", data);
    }
    put_chunk(film, "IEND", {});
    return film;
}

} // namespace trocar::engine
