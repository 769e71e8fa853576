// Where an instrument fits: the tip can reach an accepted target, a refused entry or target names a place that is accepted.
#include "base/inside.hpp"
#include "engine/prepare/standing_room.hpp"
#include "step_fixture.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <regex>

namespace trocar::engine {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

struct Places {
    Vec3 entry{0.0, 0.0, 10.0}, target{25.0 + 30.0, 0.0, 75.0}; // mm
    double tolerance = 3.0, radius = 0.5;                       // mm
};

/// Tube of 3 mm round a bend of 25 mm.
std::string tube_scene(const Places& places) {
    return fmt::format(R"({{"name": "tube", "units": {{"length": "mm", "pressure": "MPa"}}, "time": {{"step": 0.01, "duration": 1}},
        "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [{}], "sides": 16}}}}}},
        "instruments": {{"wire": {{"length": 220, "radius": {}, "young_modulus": 60, "segment": 5, "skin_triangles": 400, "lumen": "tube",
            "entry": {{"position": [{}, {}, {}], "direction": [0, 0, 1]}}, "inserted": 5,
            "follow": {{"target": "end", "tolerance": {}}}}}}},
        "targets": {{"end": {{"position": [{}, {}, {}]}}}}, "effects": ["coarse_contact", "exact_contact"]}})",
                       test::bent_axis(25.0, 3.0), places.radius, places.entry.x(), places.entry.y(), places.entry.z(), places.tolerance,
                       places.target.x(), places.target.y(), places.target.z());
}

Result<PreparedScene> try_to_prepare(const Places& places) {
    const Result<Scene> scene = parse_scene(tube_scene(places), "room.json");
    EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
    return make_prepared_scene(*scene);
}

/// mm; the place that a message names.
std::optional<Vec3> place_in(const std::string& message) {
    const std::regex numbers(R"(such as \[([-0-9.e]+), ([-0-9.e]+), ([-0-9.e]+)\] mm)");
    std::smatch found;
    if (!std::regex_search(message, found, numbers)) return std::nullopt;
    return Vec3(std::stod(found[1]), std::stod(found[2]), std::stod(found[3]));
}

TEST(InstrumentClearance, EveryAcceptedTargetCanBeStoodOnAndEveryRefusedOneNamesAPlaceThatCan) {
    std::mt19937 random(18);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    int accepted = 0, refused = 0;
    for (int k = 0; k < 14; ++k) {
        Places places;
        places.target += Vec3(between(-4.0, 4.0), between(-4.0, 4.0), between(-4.0, 4.0));
        places.tolerance = between(0.05, 1.5);
        places.radius = between(0.3, 1.2);
        SCOPED_TRACE(fmt::format("target ({}, {}, {}), tolerance {}, radius {} mm", places.target.x(), places.target.y(), places.target.z(),
                                 places.tolerance, places.radius));
        const auto prepared = try_to_prepare(places);
        if (prepared.ok()) {
            ++accepted;
            const InsideTest inside(prepared->model.bodies.front().surface);
            bool stands = -inside.signed_distance(1e-3 * places.target) >= 1e-3 * places.radius;
            for (int probe = 0; probe < 20'000 && !stands; ++probe) { // all the places within the tolerance
                const Vec3 off(between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0));
                if (off.squaredNorm() > 1.0) continue;
                stands = -inside.signed_distance(1e-3 * (places.target + places.tolerance * off)) >= 0.995e-3 * places.radius;
            }
            EXPECT_TRUE(stands);
            continue;
        }
        ++refused;
        EXPECT_EQ(prepared.error().key, "targets.end");
        const auto named = place_in(prepared.error().message);
        ASSERT_TRUE(named) << prepared.error().message;
        places.target = *named;
        const auto again = try_to_prepare(places);
        EXPECT_TRUE(again.ok()) << again.error().to_string();
    }
    EXPECT_GE(accepted, 3);
    EXPECT_GE(refused, 3);
}

TEST(InstrumentClearance, AnEntryWithoutClearanceNamesAPlaceNearItThatHas) {
    for (const Vec3& entry : {Vec3(2.9, 0.0, 10.0), Vec3(0.0, 6.0, 12.0), Vec3(-2.6, 0.3, 4.0)}) {
        Places places;
        places.entry = entry;
        const auto refused = try_to_prepare(places);
        ASSERT_FALSE(refused.ok());
        EXPECT_EQ(refused.error().key, "instruments.wire.entry");
        const auto named = place_in(refused.error().message);
        ASSERT_TRUE(named) << refused.error().message;
        EXPECT_LT((*named - entry).norm(), 6.0);
        places.entry = *named;
        const auto again = try_to_prepare(places);
        EXPECT_TRUE(again.ok()) << again.error().to_string();
    }
}

TEST(InstrumentClearance, ATargetBesideTheWallOrAToleranceWiderThanTheVesselIsNoted) {
    Places places;
    places.target = Vec3(55.0, 2.9, 75.0);
    const auto beside = try_to_prepare(places);
    ASSERT_TRUE(beside.ok()) << beside.error().to_string();
    EXPECT_THAT(beside->bodies.front().notes, Contains(AllOf(HasSubstr("targets.end has"), HasSubstr("comes no nearer than"))));
    places.target = Places{}.target;
    places.tolerance = 8.0;
    const auto wide = try_to_prepare(places);
    ASSERT_TRUE(wide.ok());
    EXPECT_THAT(wide->bodies.front().notes, Contains(HasSubstr("tolerance of 8 mm is wider than the lumen")));
    places.tolerance = 2.0;
    const auto fine = try_to_prepare(places);
    ASSERT_TRUE(fine.ok());
    EXPECT_THAT(fine->bodies.front().notes, ::testing::Not(Contains(HasSubstr("targets.end"))));
}

} // namespace
} // namespace trocar::engine
