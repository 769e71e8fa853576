#include "engine/fluoroscopy/grey_png.hpp"

#include "engine/io/atomic_file.hpp"

#include <fmt/format.h>
#include <png.h>

#include <csetjmp>

namespace trocar::engine {

namespace {

constexpr int kCompression = 3; // of 1 to 9: frames are many

void append(png_structp png, png_bytep data, png_size_t size) {
    static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), size);
}

/// Nothing here has a destructor that a jump out of libpng would leave out.
bool write_rows(png_structp png, png_infop info, const GreyFrame& frame, std::string& bytes, std::vector<png_byte>& row) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_set_write_fn(png, &bytes, append, nullptr);
    png_set_compression_level(png, kCompression);
    png_set_IHDR(png, info, frame.width, frame.height, static_cast<int>(frame.bits), PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (unsigned y = 0; y < frame.height; ++y) {
        for (unsigned x = 0; x < frame.width; ++x) {
            const std::uint16_t value = frame.values[std::size_t{y} * frame.width + x];
            if (frame.bits == 16) {
                row[2 * x] = static_cast<png_byte>(value >> 8);
                row[2 * x + 1] = static_cast<png_byte>(value & 0xff);
            } else
                row[x] = static_cast<png_byte>(value);
        }
        png_write_row(png, row.data());
    }
    png_write_end(png, info);
    return true;
}

} // namespace

Result<std::string> encode_grey_png(const GreyFrame& frame) {
    if (frame.width == 0 || frame.height == 0 || frame.values.size() != std::size_t{frame.width} * frame.height ||
        (frame.bits != 8 && frame.bits != 16))
        return Error{ErrorCode::BadValue, fmt::format("a picture of {} x {} pixels cannot have {} values of {} bits", frame.width, frame.height,
                                                      frame.values.size(), frame.bits)};
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
    std::string bytes;
    std::vector<png_byte> row(std::size_t{frame.width} * (frame.bits / 8));
    const bool written = info != nullptr && write_rows(png, info, frame, bytes, row);
    png_destroy_write_struct(&png, &info);
    if (!written) return Error{ErrorCode::ToolFailed, "libpng cannot write the picture"};
    return bytes;
}

Result<void> write_grey_png(const std::filesystem::path& path, const GreyFrame& frame) {
    const Result<std::string> bytes = encode_grey_png(frame);
    if (!bytes) return bytes.error();
    return write_file_atomically(path, *bytes);
}

} // namespace trocar::engine
