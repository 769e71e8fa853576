// Frames on the wire: read back with a decoder of the test's own, they are the snapshot to half a unit.
#include "engine/viewer/frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace trocar::engine::viewer {
namespace {

/// A viewer: keeps numbers from frame to frame, as the page does. Follows frame.hpp's description, not its code.
class Decoder {
public:
    struct Part {
        float low[3]{}, unit[3]{};
        std::vector<std::uint16_t> numbers;
    };
    std::vector<Part> parts;
    std::vector<float> dots, rod, spheres;
    std::vector<std::uint8_t> kinds;
    std::uint32_t id = 0, base = 0;
    double time = 0.0;

    void read(const std::string& message) {
        text_ = &message;
        at_ = 0;
        ASSERT_EQ(get<std::uint8_t>(), 1);
        ASSERT_EQ(get<std::uint8_t>(), 2);
        parts.resize(get<std::uint16_t>());
        const auto last = id;
        id = get<std::uint32_t>();
        base = get<std::uint32_t>();
        ASSERT_TRUE(base == 0 || base == last) << base << " after " << last;
        const auto dot_count = get<std::uint32_t>();
        time = get<double>();
        const auto sphere_count = get<std::uint32_t>();
        const auto rod_count = get<std::uint32_t>();
        for (Part& part : parts) read_part(part);
        dots = many<float>(4 * dot_count);
        rod = many<float>(3 * rod_count);
        spheres = many<float>(4 * sphere_count);
        kinds = many<std::uint8_t>(sphere_count);
        align();
        ASSERT_EQ(at_, message.size());
    }
    [[nodiscard]] double position(std::size_t part, std::size_t vertex, std::size_t axis) const {
        const Part& p = parts[part];
        return static_cast<double>(p.low[axis]) + static_cast<double>(p.unit[axis]) * p.numbers[3 * vertex + axis];
    }

private:
    void read_part(Part& part) {
        for (float& low : part.low) low = get<float>();
        for (float& unit : part.unit) unit = get<float>();
        const std::size_t numbers = 3 * get<std::uint32_t>();
        part.numbers.resize(numbers);
        const auto codings = many<std::uint8_t>((numbers / 3 + 511) / 512);
        align();
        for (std::size_t block = 0, begin = 0; begin < numbers; ++block, begin += 1536) {
            const std::size_t count = std::min<std::size_t>(1536, numbers - begin);
            if (codings[block] == 1) {
                const auto whole = many<std::uint16_t>(count);
                std::copy(whole.begin(), whole.end(), part.numbers.begin() + static_cast<std::ptrdiff_t>(begin));
            } else if (codings[block] == 2) {
                const auto differences = many<std::int8_t>(count);
                for (std::size_t k = 0; k < count; ++k)
                    part.numbers[begin + k] = static_cast<std::uint16_t>(part.numbers[begin + k] + differences[k]);
            } else
                EXPECT_EQ(codings[block], 0);
            align();
        }
    }
    template <class T>
    T get() {
        T value{};
        EXPECT_LE(at_ + sizeof(T), text_->size());
        if (at_ + sizeof(T) <= text_->size()) std::memcpy(&value, text_->data() + at_, sizeof(T));
        at_ += sizeof(T);
        return value;
    }
    template <class T>
    std::vector<T> many(std::size_t count) {
        std::vector<T> values(count);
        for (T& value : values) value = get<T>();
        return values;
    }
    void align() { at_ = (at_ + 3) / 4 * 4; }
    const std::string* text_ = nullptr;
    std::size_t at_ = 0;
};

Snapshot make_snapshot(std::mt19937& random, std::size_t vertices) {
    std::uniform_real_distribution<float> anywhere(-0.2f, 0.3f);
    Snapshot snapshot;
    for (const std::size_t count : {vertices, std::size_t{7}, std::size_t{0}}) {
        std::vector<Point> surface(count);
        for (Point& p : surface)
            for (float& x : p) x = anywhere(random);
        snapshot.surfaces.push_back(surface);
        snapshot.moves.push_back(count != 7);
    }
    return snapshot;
}

void move(Snapshot& snapshot, std::mt19937& random, float by) {
    std::uniform_real_distribution<float> little(-by, by);
    for (Point& p : snapshot.surfaces[0])
        for (float& x : p) x += little(random);
}

void expect_shown(const Decoder& decoder, const Snapshot& snapshot) {
    ASSERT_EQ(decoder.parts.size(), snapshot.surfaces.size());
    for (std::size_t part = 0; part < snapshot.surfaces.size(); ++part)
        for (std::size_t v = 0; v < snapshot.surfaces[part].size(); ++v)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double unit = static_cast<double>(decoder.parts[part].unit[axis]);
                // half a unit, and what float arithmetic adds at 0.5 m
                ASSERT_NEAR(decoder.position(part, v, axis), static_cast<double>(snapshot.surfaces[part][v][axis]), 0.5 * unit + 1e-7);
            }
}

TEST(ViewerFrames, ShowTheSnapshotToHalfAUnit) {
    std::mt19937 random(7);
    Snapshot snapshot = make_snapshot(random, 3000);
    snapshot.contacts = {{{0.1f, 0.2f, 0.3f}, 1e-4f}};
    snapshot.rod = {{0, 0, 0}, {0, 0, 0.1f}};
    snapshot.spheres = {{{1, 2, 3}, 4, SphereKind::Assumed}, {{5, 6, 7}, 8, SphereKind::Free}};
    FrameStore store;
    store.add(snapshot);
    Decoder decoder;
    decoder.read(*store.encode(0));
    expect_shown(decoder, snapshot);
    EXPECT_EQ(decoder.dots, (std::vector<float>{0.1f, 0.2f, 0.3f, 1e-4f}));
    EXPECT_EQ(decoder.rod.size(), 6u);
    EXPECT_EQ(decoder.spheres, (std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8}));
    EXPECT_EQ(decoder.kinds, (std::vector<std::uint8_t>{2, 0}));
    for (const float unit : decoder.parts[0].unit) EXPECT_LT(unit, 1.1e-5f); // half a metre and its margin in 65535 parts
}

/// Every viewer sees the same, whichever frames it got before.
TEST(ViewerFrames, ThatContinueOthersShowWhatWholeOnesShow) {
    std::mt19937 random(11);
    Snapshot snapshot = make_snapshot(random, 3000);
    FrameStore store;
    Decoder quick, slow;
    std::size_t continued = 0;
    for (int k = 0; k < 60; ++k) {
        if (k % 5 != 0) move(snapshot, random, k % 7 == 0 ? 0.05f : 2e-5f); // sometimes at rest, sometimes far
        snapshot.report.time_s = 0.01 * k;
        store.add(snapshot);
        quick.read(*store.encode(quick.id));
        continued += quick.base != 0;
        expect_shown(quick, snapshot);
        EXPECT_EQ(quick.time, snapshot.report.time_s);
        if (k % 9 == 0) {
            slow.read(*store.encode(slow.id));
            expect_shown(slow, snapshot);
        }
        Decoder whole;
        whole.read(*store.encode(0));
        for (std::size_t part = 0; part < whole.parts.size(); ++part) EXPECT_EQ(whole.parts[part].numbers, quick.parts[part].numbers);
    }
    EXPECT_EQ(continued, 59u);
}

TEST(ViewerFrames, TakeHalfTheBytesWhereLittleMoves) {
    std::mt19937 random(3);
    Snapshot snapshot = make_snapshot(random, 30'000);
    FrameStore store;
    store.add(snapshot);
    const std::size_t whole = store.encode(0)->size();
    store.add(snapshot);
    EXPECT_LT(store.encode(1)->size(), 400u); // codings alone
    move(snapshot, random, 2e-4f);
    store.add(snapshot);
    EXPECT_LT(store.encode(2)->size(), whole * 51 / 100);
}

TEST(ViewerFrames, ThatAreForgottenAreNoBase) {
    std::mt19937 random(3);
    const Snapshot snapshot = make_snapshot(random, 10);
    FrameStore store;
    for (std::size_t k = 0; k <= FrameStore::kKept; ++k) store.add(snapshot);
    Decoder decoder;
    decoder.id = 1;
    decoder.read(*store.encode(1));
    EXPECT_EQ(decoder.base, 0u);
    EXPECT_NE(store.encode(2)->size(), store.encode(1)->size()); // the second is still known
}

/// A box that no longer holds its surface is made anew: nothing is clamped.
TEST(ViewerFrames, FollowASurfaceThatLeavesItsBox) {
    std::mt19937 random(5);
    Snapshot snapshot = make_snapshot(random, 600);
    FrameStore store;
    Decoder decoder;
    for (int k = 0; k < 8; ++k) {
        store.add(snapshot);
        decoder.read(*store.encode(decoder.id));
        expect_shown(decoder, snapshot);
        for (Point& p : snapshot.surfaces[0]) p[1] += 0.04f;
    }
}

TEST(ViewerFrames, SurviveVerticesThatAreNotFinite) {
    Snapshot snapshot;
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    snapshot.surfaces = {{{nan, nan, nan}, {inf, -inf, 0.1f}, {0.0f, 0.1f, 0.2f}}, {{nan, nan, nan}}};
    snapshot.moves = {true, true};
    FrameStore store;
    store.add(snapshot);
    store.add(snapshot);
    Decoder decoder;
    decoder.id = 1;
    decoder.read(*store.encode(0));
    EXPECT_NEAR(decoder.position(0, 2, 1), 0.1, 1e-5);
}

TEST(ViewerModels, SayTheirTrianglesAndThoseFromAfar) {
    const std::vector<Triangle> all{{0, 1, 2}, {2, 1, 3}}, far{{0, 1, 3}};
    for (const auto& few : {std::vector<Triangle>{}, far}) {
        const std::string message = encode_model(5, all, few);
        std::vector<std::uint32_t> words((message.size() + 3) / 4);
        std::memcpy(words.data(), message.data(), message.size());
        std::vector<std::uint32_t> expected{2u | 2u << 8 | 5u << 16, 2, 0, 1, 2, 2, 1, 3, static_cast<std::uint32_t>(few.size())};
        for (const Triangle& t : few) expected.insert(expected.end(), t.begin(), t.end());
        EXPECT_EQ(words, expected);
    }
}

} // namespace
} // namespace trocar::engine::viewer
