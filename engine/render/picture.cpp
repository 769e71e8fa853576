#include "engine/render/picture.hpp"

#include "engine/io/atomic_file.hpp"

#include <fmt/format.h>
#include <png.h>

#include <string_view>

namespace trocar::engine {

Result<std::vector<std::uint8_t>> encode_png(const Picture& picture) {
    const bool fits = picture.width > 0 && picture.height > 0 &&
                      picture.rgb.size() == 3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
    if (!fits)
        return Error{ErrorCode::BadValue,
                     fmt::format("a picture of {} x {} pixels cannot have {} bytes", picture.width, picture.height, picture.rgb.size())};
    png_image image = {};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(picture.width);
    image.height = static_cast<png_uint_32>(picture.height);
    image.format = PNG_FORMAT_RGB;
    image.flags = PNG_IMAGE_FLAG_FAST; // a run waits for its pictures: a little larger, but sooner there

    std::vector<std::uint8_t> bytes(PNG_IMAGE_PNG_SIZE_MAX(image));
    png_alloc_size_t size = bytes.size();
    if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) == 0)
        return Error{ErrorCode::ToolFailed, fmt::format("libpng: {}", image.message)};
    bytes.resize(size);
    return bytes;
}

Result<void> write_png(const std::filesystem::path& path, const Picture& picture) {
    const Result<std::vector<std::uint8_t>> bytes = encode_png(picture);
    if (!bytes) return bytes.error();
    return write_file_atomically(path, std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
}

} // namespace trocar::engine
