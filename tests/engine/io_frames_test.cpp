// A recorded sequence: what is read, and what is refused.
#include "engine/io/frames.hpp"
#include "engine/prepare/process.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

namespace trocar::engine {
namespace {

template <class Value>
void write_array(const std::filesystem::path& file, const std::vector<Value>& values) {
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(Value)));
}

/// One triangle of three objects, two frames.
void write_sequence(const std::filesystem::path& folder, const std::vector<std::int32_t>& objects,
                    const std::vector<std::int32_t>& corners) {
    std::ofstream(folder / "meta.txt") << "name one\nnV 3\nnT 1\nframes 2\n";
    write_array(folder / "tris.i32", corners);
    write_array(folder / "obj.i32", objects);
    write_array(folder / "pos.f64", std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1});
}

TEST(Frames, NumbersOfObjectsAndVerticesAreThoseThereAre) {
    auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    const auto read = [&](const std::vector<std::int32_t>& objects, const std::vector<std::int32_t>& corners) {
        write_sequence(folder->path(), objects, corners);
        return read_frames(folder->path());
    };
    const auto sound = read({0, 1, 65535}, {0, 1, 2});
    ASSERT_TRUE(sound.ok());
    EXPECT_EQ(sound->vertex_count(), 3u);
    for (const std::int32_t object : {-1, 65536, INT32_MIN, INT32_MAX}) {
        const auto wrong = read({0, object, 0}, {0, 1, 2});
        ASSERT_FALSE(wrong.ok()) << object;
        EXPECT_NE(wrong.error().message.find(fmt::format("vertex 1 has object {}", object)), std::string::npos) << wrong.error().message;
    }
    for (const std::int32_t corner : {-1, 3, INT32_MIN}) EXPECT_FALSE(read({0, 0, 0}, {0, corner, 2}).ok()) << corner;
}

} // namespace
} // namespace trocar::engine
