#include "engine/io/frames.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <map>
#include <sstream>

namespace trocar::engine {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are little-endian");
static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Triangle) == 3 * sizeof(std::int32_t));

struct Meta {
    std::string name;
    std::size_t vertices = 0, triangles = 0, frames = 0;
};

Result<Meta> read_meta(const std::filesystem::path& path) {
    const Result<std::string> text = read_file_bytes(path);
    if (!text) return text.error();
    std::istringstream lines(*text);
    Meta meta;
    std::map<std::string, std::size_t*> wanted{{"nV", &meta.vertices}, {"nT", &meta.triangles}, {"frames", &meta.frames}};
    std::size_t line_number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++line_number;
        std::istringstream words(line);
        std::string key, value;
        if (!(words >> key)) continue;
        words >> value;
        if (key == "name") meta.name = value;
        const auto entry = wanted.find(key);
        if (entry == wanted.end()) continue;
        const bool whole = !value.empty() && value.size() <= 10 && value.find_first_not_of("0123456789") == value.npos;
        if (!whole || std::stoull(value) == 0 || std::stoull(value) > 0x7fffffff)
            return Error{ErrorCode::BadValue,
                         fmt::format("is '{}'; expected an integer from 1 to 2147483647", value.substr(0, 40)),
                         path.string(),
                         line_number,
                         0,
                         key};
        *entry->second = std::stoull(value);
    }
    for (const auto& [key, count] : wanted)
        if (*count == 0) return Error{ErrorCode::BadSyntax, "has no line '" + key + " COUNT'", path.string()};
    if (meta.frames < 2) return Error{ErrorCode::BadValue, "one frame is no motion; two or more are wanted", path.string(), 0, 0, "frames"};
    return meta;
}

/// A file that must hold count values, copied into `out`.
template <class Value>
Result<void> read_array(const std::filesystem::path& path, std::size_t count, const std::string& shape, std::vector<Value>& out) {
    const Result<std::string> bytes = read_file_bytes(path);
    if (!bytes) return bytes.error();
    if (bytes->size() % sizeof(Value) != 0 || bytes->size() / sizeof(Value) != count) // count * sizeof may not fit into 64 bits
        return Error{ErrorCode::BadSyntax,
                     fmt::format("has {} bytes; meta.txt makes it {:.17g}: {}", bytes->size(),
                                 static_cast<double>(count) * static_cast<double>(sizeof(Value)), shape),
                     path.string()};
    out.resize(count);
    if (!bytes->empty()) std::memcpy(static_cast<void*>(out.data()), bytes->data(), bytes->size());
    return {};
}

Result<void> check(const FrameSequence& frames, const std::filesystem::path& folder) {
    const std::size_t vertices = frames.vertex_count();
    for (std::size_t t = 0; t < frames.triangles.size(); ++t)
        for (const Index v : frames.triangles[t])
            if (v >= vertices)
                return Error{ErrorCode::BadValue,
                             fmt::format("triangle {} names vertex {}; there are {}", t, static_cast<std::int32_t>(v), vertices),
                             (folder / "tris.i32").string()};
    for (std::size_t v = 0; v < vertices; ++v)
        if (frames.objects[v] < 0 || frames.objects[v] > 0xffff)
            return Error{ErrorCode::BadValue, fmt::format("vertex {} has object {}; 0 to 65535 are possible", v, frames.objects[v]),
                         (folder / "obj.i32").string()};
    for (std::size_t i = 0; i < frames.positions.size(); ++i)
        if (!is_finite(frames.positions[i]))
            return Error{ErrorCode::BadValue,
                         fmt::format("frame {}, vertex {} is ({}, {}, {}); finite numbers are wanted", i / vertices, i % vertices,
                                     frames.positions[i][0], frames.positions[i][1], frames.positions[i][2]),
                         (folder / "pos.f64").string()};
    return {};
}

template <class Value>
std::string_view bytes_of(const std::vector<Value>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

} // namespace

Result<FrameSequence> read_frames(const std::filesystem::path& folder) {
    const Result<Meta> meta = read_meta(folder / "meta.txt");
    if (!meta) return meta.error();
    FrameSequence out;
    out.name = meta->name;
    out.frame_count = meta->frames;
    const auto triangles = read_array(folder / "tris.i32", meta->triangles, fmt::format("int32 [{}][3]", meta->triangles), out.triangles);
    if (!triangles) return triangles.error();
    const auto objects = read_array(folder / "obj.i32", meta->vertices, fmt::format("int32 [{}]", meta->vertices), out.objects);
    if (!objects) return objects.error();
    const auto positions = read_array(folder / "pos.f64", meta->frames * meta->vertices,
                                      fmt::format("float64 [{}][{}][3]", meta->frames, meta->vertices), out.positions);
    if (!positions) return positions.error();
    const auto checked = check(out, folder);
    if (!checked) return checked.error();
    return out;
}

Result<void> write_frames(const std::filesystem::path& folder, const FrameSequence& frames) {
    std::error_code failed;
    std::filesystem::create_directories(folder, failed);
    if (failed) return Error{ErrorCode::CannotWrite, "cannot be made: " + failed.message(), folder.string()};
    const std::pair<const char*, std::string_view> parts[] = {
        {"tris.i32", bytes_of(frames.triangles)}, {"obj.i32", bytes_of(frames.objects)}, {"pos.f64", bytes_of(frames.positions)}};
    for (const auto& [name, bytes] : parts)
        if (const auto written = write_file_atomically(folder / name, bytes); !written) return written;
    return write_file_atomically(folder / "meta.txt", fmt::format("name {}\nnV {}\nnT {}\nframes {}\n", frames.name, frames.vertex_count(),
                                                                  frames.triangles.size(), frames.frame_count));
}

} // namespace trocar::engine
