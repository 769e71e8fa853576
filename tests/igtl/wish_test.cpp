// What clients ask for, without a network: commands, drive commands, names of devices.
#include "../engine/step_fixture.hpp"

#include "engine/igtl/read_wish.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>

namespace trocar::engine::igtl {
namespace {

using ::testing::HasSubstr;

struct Known {
    PreparedScene prepared = engine::test::prepare(engine::test::bent_tube_scene());
    Devices devices = name_devices(prepared.model);

    Result<Wish> command(std::string_view text) const { return read_command(text, prepared.model, devices); }
    Result<Wish> drive(const Transform& transform, std::string_view device = "wire_drive") const {
        return read_drive(device, transform, prepared.model, devices);
    }
};

template <class T>
bool is_command(const Result<Wish>& wish) {
    if (!wish.ok()) return false;
    const auto* command = std::get_if<viewer::Command>(&*wish);
    return command != nullptr && std::holds_alternative<T>(*command);
}

TEST(IgtlWish, ReadsEveryCommandOfThePage) {
    const Known known;
    EXPECT_TRUE(is_command<viewer::Pause>(known.command("pause")));
    EXPECT_TRUE(is_command<viewer::Pause>(known.command("  go on\n")));
    EXPECT_TRUE(is_command<viewer::SingleStep>(known.command("step")));
    EXPECT_TRUE(is_command<viewer::Restart>(known.command("restart")));
    EXPECT_TRUE(is_command<viewer::Drive>(known.command("stop")));
    EXPECT_TRUE(is_command<viewer::FollowScript>(known.command("script on")));
    EXPECT_TRUE(is_command<viewer::FollowScript>(known.command("script off")));
    for (const char* other : {"surfaces", "take", "leave"}) EXPECT_TRUE(known.command(other).ok()) << other;
    const auto insert = known.command("insert wire -17.5"), rotate = known.command("rotate wire 90");
    ASSERT_TRUE(insert.ok() && rotate.ok());
    EXPECT_NEAR(std::get<InsertAt>(*insert).share, -0.5, 1e-12);
    EXPECT_NEAR(std::get<RotateAt>(*rotate).share, 0.5 * 3.14159265358979 / 3.14, 1e-9);
}

TEST(IgtlWish, SaysWhatItExpectedInPlaceOfWhatItDoesNotKnow) {
    const Known known;
    const auto said = [&](const std::string& text) {
        const auto wish = known.command(text);
        return wish.ok() ? std::string("accepted") : wish.error().message;
    };
    EXPECT_THAT(said("dance"), HasSubstr("expected pause, go on"));
    EXPECT_THAT(said(""), HasSubstr("expected pause"));
    EXPECT_THAT(said("insert"), HasSubstr("expected pause"));
    EXPECT_THAT(said("insert catheter 5"), HasSubstr("expected \"wire\""));
    EXPECT_THAT(said("insert wire"), HasSubstr("expected"));
    EXPECT_THAT(said("insert wire fast"), HasSubstr("-35 to 35 mm/s"));
    EXPECT_THAT(said("insert wire 36"), HasSubstr("-35 to 35 mm/s"));
    EXPECT_THAT(said("insert wire nan"), HasSubstr("-35 to 35 mm/s"));
    EXPECT_THAT(said("rotate wire inf"), HasSubstr("degrees/s"));
    EXPECT_THAT(said("inject"), HasSubstr("no contrast"));
    EXPECT_THAT(said(std::string(1000, 'x')), HasSubstr("at most 256"));
    EXPECT_THAT(said("a\x1b[31mb"), ::testing::Not(HasSubstr("\x1b")));
}

TEST(IgtlWish, ADriveCommandIsATranslationAlongZAndARotationAboutIt) {
    const Known known;
    const double angle = -2.5;
    const Transform good{{std::cos(angle), std::sin(angle), 0}, {-std::sin(angle), std::cos(angle), 0}, Vec3::UnitZ(), {0, 0, 0.055}};
    const auto wish = known.drive(good);
    ASSERT_TRUE(wish.ok());
    EXPECT_NEAR(std::get<MoveTo>(*wish).insertion, 0.055, 1e-12);
    EXPECT_NEAR(std::get<MoveTo>(*wish).angle, angle, 1e-12);
    EXPECT_THAT(known.drive(good, "pump_drive").error().message, HasSubstr("expected \"wire_drive\""));
    EXPECT_FALSE(known.drive(good, "wire_tip").ok());
    for (const double odd : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e30}) {
        Transform bad = good;
        bad.origin.z() = odd;
        EXPECT_FALSE(known.drive(bad).ok()) << odd;
        bad = good;
        bad.x.y() = odd;
        EXPECT_FALSE(known.drive(bad).ok()) << odd;
    }
    Transform tilted = good;
    tilted.z = Vec3(0.1, 0, 0.99).normalized();
    EXPECT_THAT(known.drive(tilted).error().message, HasSubstr("another axis than z"));
    EXPECT_FALSE(known.drive({Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()}).ok());
}

TEST(IgtlWish, RandomTextIsRefusedOrInRange) {
    const Known known;
    std::mt19937 random(7);
    const std::vector<std::string> pieces{"insert", "rotate", " ", "wire", "-", "1e9", "35", "\0", "\xff", "go", "on", ".", "nan", "999999999999999999999"};
    for (int k = 0; k < 20'000; ++k) {
        std::string text;
        for (std::size_t n = random() % 7; n > 0; --n) text += pieces[random() % pieces.size()];
        const auto wish = known.command(text);
        if (!wish.ok()) continue;
        if (const auto* insert = std::get_if<InsertAt>(&*wish)) {
            EXPECT_LE(std::abs(insert->share), 1.0) << text;
        }
        if (const auto* rotate = std::get_if<RotateAt>(&*wish)) {
            EXPECT_LE(std::abs(rotate->share), 1.0) << text;
        }
    }
}

TEST(IgtlDevices, NamesFitIntoTwentyBytesAndNoTwoAreTheSame) {
    SceneModel model;
    for (const char* name : {"aorta", "aorta\n", "aorta ", "trocar", "a_very_long_name_of_a_vessel_1", "a_very_long_name_of_a_vessel_2", "", "wire_tip"}) {
        model.bodies.emplace_back();
        model.bodies.back().name = name;
    }
    for (const char* name : {"wire", "wire", "a_very_long_name_of_a_wire", "a_very_long_name_of_another", "\xc3\xa4"}) {
        model.instruments.emplace_back();
        model.instruments.back().name = name;
    }
    const Devices devices = name_devices(model);
    std::set<std::string> all;
    const auto add = [&](const std::string& name) {
        EXPECT_LE(name.size(), kLongestName) << name;
        EXPECT_FALSE(name.empty());
        EXPECT_TRUE(all.insert(name).second) << name << " is there twice";
        for (const char c : name) EXPECT_TRUE(c > ' ' && c <= '~') << name;
    };
    for (const std::string& name : devices.bodies) add(name);
    for (const InstrumentDevices& names : devices.instruments) add(names.skin), add(names.tip), add(names.drive);
    EXPECT_EQ(devices.bodies[0], "aorta");
    EXPECT_EQ(devices.instruments[0].drive, "wire_drive");
    EXPECT_FALSE(all.contains("trocar"));
}

} // namespace
} // namespace trocar::engine::igtl
