// What one frame says of a state: masks, depth and places agree with the projection and with what the rays attenuate.
#include "../engine/step_fixture.hpp"

#include "engine/fluoroscopy/matter.hpp"
#include "engine/fluoroscopy/observation.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

struct Seen {
    PreparedScene prepared = test::prepare(test::bent_tube_scene({35, "exact", R"("coarse_contact", "exact_contact", "elasticity")", test::kOrgan}));
    FluoroscopySpec spec;
    XrayView view;
    std::optional<Simulator> simulator;

    Seen() {
        simulator.emplace(prepared.model);
        for (int k = 0; k < 40; ++k) simulator->step();
        view = XrayPatient::whole_view(prepared.model, simulator->state(), {160, 128});
        view.primary = 0.4, view.secondary = -0.2;
        view.display = XrayDisplay::Log;
    }
    [[nodiscard]] XrayObservation observed(unsigned threads = 1) {
        XrayPatient patient(spec, prepared.model);
        Fluoroscope scope(view, threads);
        return observe(scope, patient, prepared.model, simulator->state(), 7);
    }
};

/// The space around solids is nothing to see.
TEST(Observation, TheFreeSpaceAroundSolidsIsNeitherInThePictureNorInTheDepth) {
    const std::string ball = R"("ball": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, 0], "radius": 30, "subdivisions": 3},
        "coarse": {"mesher": "lattice", "surface_triangles": 400}})";
    const auto prepare = [](const std::string& bodies) {
        return test::prepare(fmt::format(R"({{"name": "seen", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 1}},
            "budget": "exact", "bodies": {{{}}}, "effects": ["elasticity"]}})", bodies));
    };
    const PreparedScene alone = prepare(ball), with = prepare(ball + R"(, "space": {"kind": "static", "hollow": true, "surface": {"around": ["ball"]}})");
    const FluoroscopySpec spec;
    const XrayView view = XrayPatient::whole_view(alone.model, make_initial_state(alone.model), {96, 96});
    EXPECT_EQ(view.detector, XrayPatient::whole_view(with.model, make_initial_state(with.model), {96, 96}).detector);
    XrayPatient one(spec, alone.model), two(spec, with.model);
    Fluoroscope a(view), b(view);
    const State lone = make_initial_state(alone.model), both = make_initial_state(with.model);
    EXPECT_EQ(a.project(one, lone).attenuation, b.project(two, both).attenuation);
    EXPECT_EQ(a.depth(one, lone).values, b.depth(two, both).values);
    const auto seen = a.project(one, lone).attenuation;
    EXPECT_GT(*std::max_element(seen.begin(), seen.end()), 0.1) << "the ball is in it";
}

TEST(Observation, TheDeviceMaskIsWhereTheDeviceChangesTheAttenuation) {
    Seen seen;
    const XrayObservation with = seen.observed();
    XrayPatient patient(seen.spec, seen.prepared.model);
    Fluoroscope scope(seen.view);
    const std::vector<double> whole = scope.project(patient, seen.simulator->state()).attenuation;
    State bare = seen.simulator->state();
    for (InstrumentState& instrument : bare.instruments) // all of it in one place, which attenuates nothing
        std::fill(instrument.skin.begin(), instrument.skin.end(), instrument.skin.front());
    const std::vector<double> without = scope.project(patient, bare).attenuation;
    std::size_t device = 0;
    double metal = 0.0;
    for (std::size_t k = 0; k < whole.size(); ++k) {
        EXPECT_EQ(with.device.values[k] == 255, whole[k] != without[k]) << "pixel " << k;
        device += with.device.values[k] == 255;
        metal += whole[k] - without[k];
    }
    EXPECT_GT(device, 50u);
    EXPECT_GT(metal, 0.0);
}

/// Attenuations of a straight vessel of 6 mm along the table, 90 mm of detector in 128 pixels.
XrayFrame frame_of_tube(const FluoroscopySpec& spec) {
    const PreparedScene prepared = test::prepare(R"({"name": "tube", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 0.1}, "bodies":
        {"tube": {"kind": "static", "hollow": true, "surface": {"shape": "tube", "axis": [[0, 0, -60, 6], [0, 0, 60, 6]], "sides": 96}}}})");
    static XrayView view;
    view = {};
    view.pixels = {129, 129}, view.detector = {0.03, 0.03};
    XrayPatient patient(spec, prepared.model);
    EXPECT_FALSE(patient.bodies()[0].shell > 0.0);
    Fluoroscope scope(view);
    return scope.project(patient, Simulator(prepared.model).state());
}

TEST(Observation, AVesselsWallAttenuatesByItsOwnThickness) {
    FluoroscopySpec spec;
    const XrayFrame bare = frame_of_tube(spec);
    spec.wall = 1.5e-3;
    for (const XrayMatter matter : {XrayMatter::Tissue, XrayMatter::Bone, XrayMatter::Blood}) {
        spec.wall_matter = matter;
        const XrayFrame walled = frame_of_tube(spec);
        const double blood = coefficient_of(XrayMatter::Blood).linear(), wall = coefficient_of(matter).linear();
        unsigned compared = 0;
        for (std::size_t column = 0; column < 129; ++column) {
            const double sine = (static_cast<double>(column) - 64.0) * (0.03 / 129) / std::hypot((static_cast<double>(column) - 64.0) * (0.03 / 129), 1.05);
            const double off = 0.75 * sine; // of the ray from the axis
            const auto chord = [&](double radius) { return std::abs(off) < radius ? 2.0 * std::sqrt(radius * radius - off * off) : 0.0; };
            const std::size_t k = 64 * 129 + column;
            if (std::abs(std::abs(off) - 6e-3) < 3e-4 || std::abs(std::abs(off) - 7.5e-3) < 3e-4) continue; // where a chord of 96 sides is no circle's
            EXPECT_NEAR(walled.attenuation[k], wall * (chord(7.5e-3) - chord(6e-3)) + blood * chord(6e-3), 0.01 * wall * chord(7.5e-3)) << column;
            EXPECT_NEAR(bare.attenuation[k], blood * chord(6e-3), 0.01 * blood * chord(6e-3)) << column;
            ++compared;
        }
        EXPECT_GT(compared, 100u);
    }
}

TEST(Observation, AWallOfWhatItLiesInIsNotSeen) {
    Seen seen;
    const std::vector<double> without = [&] {
        XrayPatient patient(seen.spec, seen.prepared.model);
        Fluoroscope scope(seen.view);
        return scope.project(patient, seen.simulator->state()).attenuation;
    }();
    seen.spec.wall = 1e-3;
    XrayPatient tissue(seen.spec, seen.prepared.model);
    Fluoroscope scope(seen.view);
    EXPECT_EQ(scope.project(tissue, seen.simulator->state()).attenuation, without);
    seen.spec.wall_matter = XrayMatter::Bone;
    XrayPatient calcified(seen.spec, seen.prepared.model);
    Fluoroscope other(seen.view);
    const std::vector<double>& with = other.project(calcified, seen.simulator->state()).attenuation;
    for (std::size_t k = 0; k < with.size(); ++k) EXPECT_GE(with[k], without[k] - 1e-6) << "pixel " << k;
    EXPECT_NE(with, without);
}

TEST(Observation, EveryRayThatMeetsTheVesselOrADeviceHasADepth) {
    Seen seen;
    const XrayObservation of = seen.observed();
    std::size_t vessel = 0;
    for (std::size_t k = 0; k < of.depth.values.size(); ++k) {
        if (of.vessel.values[k] == 255 || of.device.values[k] == 255) {
            EXPECT_GT(of.depth.values[k], 0u) << "pixel " << k;
        }
        vessel += of.vessel.values[k] == 255;
    }
    EXPECT_GT(vessel, 200u);
}

TEST(Observation, TipsAndCentrelinesAreTheProjectedNodes) {
    Seen seen;
    const XrayObservation of = seen.observed();
    const State& state = seen.simulator->state();
    ASSERT_EQ(of.tips.size(), 1u);
    const auto tip = project(of.projection, state.instruments[0].rod.position.back());
    ASSERT_TRUE(tip);
    EXPECT_EQ(of.tips[0], *tip);
    EXPECT_EQ(of.centrelines[0].back(), *tip);
    // the pinhole written out
    const ConeBeam beam = make_cone_beam(seen.view, {seen.view.primary, seen.view.secondary});
    const Vec3 way = state.instruments[0].rod.position.back() - beam.source;
    const double over = beam.sid / way.dot(beam.along);
    EXPECT_NEAR(of.tips[0][0], 0.5 * beam.pixels[0] + over * way.dot(beam.right) / beam.pitch[0], 1e-9);
    EXPECT_NEAR(of.tips[0][1], 0.5 * beam.pixels[1] + over * way.dot(beam.down) / beam.pitch[1], 1e-9);
}

TEST(Observation, IsTheSameOnAnyNumberOfThreadsAndAgainFromTheCache) {
    Seen seen;
    seen.view.noise = true;
    const XrayObservation one = seen.observed(1);
    for (const unsigned threads : {2u, 3u, 8u}) {
        const XrayObservation many = seen.observed(threads);
        EXPECT_EQ(many.image.values, one.image.values);
        EXPECT_EQ(many.vessel.values, one.vessel.values);
        EXPECT_EQ(many.depth.values, one.depth.values);
    }
    XrayPatient patient(seen.spec, seen.prepared.model);
    Fluoroscope scope(seen.view);
    (void)observe(scope, patient, seen.prepared.model, make_initial_state(seen.prepared.model), 0); // what stands still is kept from there
    scope.console() = {};
    const XrayObservation later = observe(scope, patient, seen.prepared.model, seen.simulator->state(), 7);
    EXPECT_EQ(later.image.values, one.image.values);
    EXPECT_EQ(later.device.values, one.device.values);
    EXPECT_EQ(later.vessel.values, one.vessel.values);
    EXPECT_EQ(later.depth.values, one.depth.values);
}

TEST(Observation, TheVisiblePartOfAStateIsSeenAsTheStateIs) {
    Seen seen;
    State part = visible_part(make_initial_state(seen.prepared.model));
    update_visible_part(seen.prepared.model, seen.simulator->state(), part);
    XrayPatient patient(seen.spec, seen.prepared.model);
    Fluoroscope scope(seen.view);
    const XrayObservation of_part = observe(scope, patient, seen.prepared.model, part, 7);
    const XrayObservation of_all = seen.observed();
    EXPECT_EQ(of_part.image.values, of_all.image.values);
    EXPECT_EQ(of_part.depth.values, of_all.depth.values);
    EXPECT_EQ(of_part.tips, of_all.tips);
}

} // namespace
} // namespace trocar::engine
